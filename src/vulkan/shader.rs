//! A compiled shader and what its SPIR-V declares: bindings by name, size of the push constants.
use super::error::{Result, VulkanError};
use ash::vk;
use spirq::prelude::{AccessType, ConstantValue, DescriptorType, EntryPoint, ReflectConfig, Variable};
use spirq::spirv;
use std::collections::BTreeMap;

/// The stage that a shader is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShaderStage {
    /// Vertex shader.
    Vertex,
    /// Fragment shader.
    Fragment,
    /// Compute shader.
    Compute,
}

impl ShaderStage {
    pub(super) fn flags(self) -> vk::ShaderStageFlags {
        match self {
            Self::Vertex => vk::ShaderStageFlags::VERTEX,
            Self::Fragment => vk::ShaderStageFlags::FRAGMENT,
            Self::Compute => vk::ShaderStageFlags::COMPUTE,
        }
    }
}

/// A shader compiled at build time; the build script makes one constant of this type for each.
#[derive(Clone, Copy, Debug)]
pub struct Shader {
    /// Name of the GLSL file, with its variant.
    pub(super) name: &'static str,
    pub(super) stage: ShaderStage,
    /// SPIR-V, little-endian words, as the GLSL compiler made them: nothing else can be one.
    spirv: &'static [u8],
}

/// What a shader does with what is bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BindingAccess {
    /// `readonly`, sampled, uniform.
    ReadOnly,
    /// `writeonly`.
    WriteOnly,
    /// Neither is ruled out.
    ReadWrite,
}

/// One descriptor that a shader declares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Binding {
    pub index: u32,
    pub kind: vk::DescriptorType,
    pub access: BindingAccess,
}

/// What a shader expects from its caller.
#[derive(Debug, Default)]
pub(super) struct Interface {
    /// Descriptors of set 0, by their name in GLSL.
    pub bindings: BTreeMap<String, Binding>,
    pub push_constant_bytes: u32,
    /// Invocations of a workgroup along each axis; 0 for shaders that have none.
    pub group_size: [u32; 3],
    /// Indices of specialisation constants, by their name in GLSL.
    pub constants: BTreeMap<String, u32>,
}

impl Shader {
    /// Name of the GLSL file, with its variant.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Its SPIR-V.
    pub(crate) fn words(&self) -> Vec<u32> {
        #[cfg(feature = "hot-reload")]
        if let Some(words) = super::hot_reload::words_of(self.name) {
            return words;
        }
        self.spirv.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect()
    }

    pub(super) fn refuse(&self, problem: impl ToString) -> VulkanError {
        VulkanError::Shader { shader: self.name.to_owned(), problem: problem.to_string() }
    }

    /// Whether the shader declares a binding or a specialisation constant of that name.
    #[cfg(test)]
    pub(crate) fn declares(&self, name: &str) -> Result<bool> {
        let interface = self.reflect()?;
        Ok(interface.bindings.contains_key(name) || interface.constants.contains_key(name))
    }

    /// Reads the interface out of the SPIR-V.
    pub(super) fn reflect(&self) -> Result<Interface> {
        let entry_points = ReflectConfig::new()
            .spv(self.words())
            .ref_all_rscs(true)
            .combine_img_samplers(true)
            .reflect()
            .map_err(|cause| self.refuse(format!("SPIR-V reflection failed: {cause}")))?;
        let mut interface = Interface::default();
        for entry in entry_points {
            if self.stage == ShaderStage::Compute {
                interface.group_size = self.group_size(&entry)?;
            }
            for variable in entry.vars {
                match variable {
                    Variable::Descriptor { name, desc_bind, desc_ty, ty, .. } => {
                        // A block without an instance name is known by the name of its type.
                        let name = name
                            .filter(|name| !name.is_empty())
                            .or_else(|| ty.as_struct().and_then(|block| block.name.clone()));
                        let name = name.ok_or_else(|| self.refuse("a binding has no name"))?;
                        if desc_bind.set() != 0 {
                            return Err(self.refuse(format!("{name} is not in descriptor set 0")));
                        }
                        let (kind, access) = self.descriptor(&name, &desc_ty)?;
                        interface.bindings.insert(name, Binding { index: desc_bind.bind(), kind, access });
                    }
                    Variable::PushConstant { ty, .. } => {
                        interface.push_constant_bytes = ty.nbyte().unwrap_or(0) as u32;
                    }
                    Variable::SpecConstant { name: Some(name), spec_id, .. } => {
                        interface.constants.insert(name, spec_id);
                    }
                    _ => {}
                }
            }
        }
        self.check_bindings(&interface.bindings)?;
        Ok(interface)
    }

    /// What binding `name` is to Vulkan, and what its qualifiers let the shader do with it.
    fn descriptor(&self, name: &str, declared: &DescriptorType) -> Result<(vk::DescriptorType, BindingAccess)> {
        let by_qualifiers = |access: &AccessType| match access {
            AccessType::ReadOnly => BindingAccess::ReadOnly,
            AccessType::WriteOnly => BindingAccess::WriteOnly,
            AccessType::ReadWrite => BindingAccess::ReadWrite,
        };
        let read_only = BindingAccess::ReadOnly;
        Ok(match declared {
            DescriptorType::StorageBuffer(access) => (vk::DescriptorType::STORAGE_BUFFER, by_qualifiers(access)),
            DescriptorType::StorageImage(access) => (vk::DescriptorType::STORAGE_IMAGE, by_qualifiers(access)),
            DescriptorType::UniformBuffer() => (vk::DescriptorType::UNIFORM_BUFFER, read_only),
            DescriptorType::CombinedImageSampler() => (vk::DescriptorType::COMBINED_IMAGE_SAMPLER, read_only),
            DescriptorType::SampledImage() => (vk::DescriptorType::SAMPLED_IMAGE, read_only),
            other => return Err(self.refuse(format!("{name} is a {other:?}, which nothing here binds"))),
        })
    }

    /// The size of a workgroup. One that is a specialisation constant is refused: it would be another one in the pipeline.
    fn group_size(&self, entry: &EntryPoint) -> Result<[u32; 3]> {
        let mode = entry.exec_modes.iter().find(|mode| mode.exec_mode == spirv::ExecutionMode::LocalSize);
        let literals = mode.iter().flat_map(|mode| &mode.operands).filter_map(|size| match size.value {
            ConstantValue::U32(size) => Some(size),
            _ => None,
        });
        let sizes: Option<[u32; 3]> = literals.collect::<Vec<_>>().try_into().ok();
        sizes
            .filter(|_| !self.specialises_group_size())
            .ok_or_else(|| self.refuse("the size of its workgroups is no plain constant"))
    }

    /// Whether the built-in WorkgroupSize, which goes before the execution mode, is composed of specialisation constants.
    fn specialises_group_size(&self) -> bool {
        let words = self.words();
        let mut instructions = Vec::new();
        let mut rest = words.get(5..).unwrap_or_default();
        while let Some((instruction, after)) =
            rest.first().and_then(|first| rest.split_at_checked((first >> 16).max(1) as usize))
        {
            instructions.push(instruction);
            rest = after;
        }
        let opcode = |instruction: &[u32], op: spirv::Op| instruction[0] & 0xffff == op as u32;
        let built_in = [spirv::Decoration::BuiltIn as u32, spirv::BuiltIn::WorkgroupSize as u32];
        let is_composed = |id: u32| {
            instructions
                .iter()
                .any(|words| opcode(words, spirv::Op::SpecConstantComposite) && words.get(2) == Some(&id))
        };
        let decorations = instructions.iter().filter(|words| opcode(words, spirv::Op::Decorate));
        decorations.filter(|words| words.get(2..) == Some(&built_in[..])).any(|words| is_composed(words[1]))
    }

    /// An error where two names have one binding: the shader would silently read one as the other.
    pub(super) fn check_bindings(&self, bindings: &BTreeMap<String, Binding>) -> Result<()> {
        let mut taken = BTreeMap::new();
        for (name, binding) in bindings {
            if let Some(other) = taken.insert(binding.index, name) {
                return Err(self.refuse(format!("{other} and {name} have the same binding, {}", binding.index)));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shader_can_be_read_and_has_each_binding_once() {
        assert!(compiled::ALL.len() > 10);
        for shader in compiled::ALL {
            shader.reflect().unwrap();
        }
    }

    #[test]
    fn access_and_size_of_workgroups_are_those_of_the_glsl() {
        use BindingAccess::{ReadOnly, ReadWrite, WriteOnly};
        let shade = compiled::SHADE_FITTED.reflect().unwrap();
        for (name, access) in [
            ("geometry", ReadOnly),
            ("counters", ReadOnly),
            ("Materials", ReadOnly),
            ("environment_pyramid", ReadOnly),
            ("radiance", WriteOnly),
            ("all_lookups", ReadWrite),
        ] {
            assert_eq!(shade.bindings[name].access, access, "{name}");
        }
        assert_eq!(shade.group_size, [64, 1, 1]);
        let classify = compiled::CLASSIFY.reflect().unwrap();
        assert_eq!((classify.bindings["part_list"].access, classify.group_size), (WriteOnly, [8, 8, 1]));
        assert_eq!(compiled::BACKGROUND.reflect().unwrap().bindings["radiance"].access, ReadWrite);
    }

    #[test]
    fn a_size_of_workgroups_that_is_specialised_is_seen() {
        // Header, then OpDecorate of 7 as BuiltIn WorkgroupSize, then 7 as OpSpecConstantComposite or OpConstantComposite.
        let words =
            |composite: u32| [&[0; 5][..], &[4 << 16 | 71, 7, 11, 25], &[6 << 16 | composite, 1, 7, 2, 3, 4]].concat();
        for (composite, specialised) in [(51, true), (44, false)] {
            let spirv = words(composite).iter().flat_map(|word: &u32| word.to_le_bytes()).collect::<Vec<_>>().leak();
            let shader = Shader { spirv, name: "made up", ..compiled::TONE_MAP };
            assert_eq!(shader.specialises_group_size(), specialised);
        }
    }

    #[test]
    fn two_resources_on_one_binding_are_refused() {
        // Moves every binding of a shader to 0: OpDecorate (71, four words) with the decoration Binding (33).
        let mut words = compiled::TONE_MAP.words();
        for at in 5..words.len() - 3 {
            if words[at] == 4 << 16 | 71 && words[at + 2] == 33 {
                words[at + 3] = 0;
            }
        }
        let spirv = words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<_>>().leak();
        let problem = Shader { spirv, name: "moved", ..compiled::TONE_MAP }.reflect().unwrap_err().to_string();
        assert!(problem.contains("have the same binding, 0"), "{problem}");
    }
}

/// Every shader of `glsl/`, compiled.
pub mod compiled {
    use super::{Shader, ShaderStage};
    include!(concat!(env!("OUT_DIR"), "/shaders.rs"));
}
