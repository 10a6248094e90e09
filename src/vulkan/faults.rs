//! Calls that fail on purpose, for tests: whatever Vulkan refuses, nothing is left behind. And a hazard that has to be seen.
use ash::vk;
use std::cell::{Cell, RefCell};

/// What is to fail.
#[derive(Clone, Copy)]
pub(crate) struct Fault {
    /// Only calls of this name count; all if there is none.
    pub of: Option<&'static str>,
    /// Calls count only after so many calls of this name.
    pub after: Option<(&'static str, usize)>,
    /// Which of them, counted from 0.
    pub index: usize,
    /// What it returns.
    pub result: vk::Result,
    /// Whether all after it return that too, as those of a lost device do.
    pub lasts: bool,
}

thread_local! {
    /// Names of the calls that this thread has made.
    static MADE: RefCell<Vec<&'static str>> = const { RefCell::new(Vec::new()) };
    /// Which of them fails, how many were made of those that come first, and how many were counted.
    static FAULT: Cell<Option<(Fault, usize, usize)>> = const { Cell::new(None) };
}

/// Called before each call: an error for the one that is to fail.
pub(super) fn before(name: &'static str) -> ash::prelude::VkResult<()> {
    MADE.with_borrow_mut(|made| made.push(name));
    let Some((fault, mut preceded, counted)) = FAULT.get() else { return Ok(()) };
    let may_count = fault.after.is_none_or(|(_, enough)| preceded >= enough);
    preceded += usize::from(fault.after.is_some_and(|(first, _)| first == name));
    let counts = may_count && fault.of.is_none_or(|of| of == name);
    FAULT.set(Some((fault, preceded, counted + usize::from(counts))));
    if !counts {
        return Ok(());
    }
    let fails = counted == fault.index || (fault.lasts && counted > fault.index);
    if fails { Err(fault.result) } else { Ok(()) }
}

/// What comes of `act` with a `fault`, and the calls that it made; what it would do side by side it does on one thread.
pub(crate) fn with_fault<T: Send>(fault: Option<Fault>, act: impl FnOnce() -> T + Send) -> (T, Vec<&'static str>) {
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    one_thread.install(|| {
        FAULT.set(fault.map(|fault| (fault, 0, 0)));
        (act(), MADE.take())
    })
}

mod tests {
    use super::super::*;
    use super::{Fault, with_fault};

    const STATE: GraphicsState = GraphicsState {
        attributes: &[(ash::vk::Format::R32G32B32_SFLOAT, 12)],
        colors: &[ash::vk::Format::R16G16B16A16_SFLOAT],
        depth: ash::vk::Format::D32_SFLOAT,
    };
    const PAIR: [&Shader; 2] = [&compiled::CUBE_BORDERS_VERT, &compiled::CUBE_BORDERS_FRAG];

    /// Makes one of each kind of object, and records and submits.
    fn use_everything(messages: &mut Messages) -> Result<(), VulkanError> {
        let device = test_device::try_open_validated(messages)?;
        let cache = PipelineCache::new(&device, None)?;
        let compute = ComputePipeline::new(&device, &cache, &compiled::TONE_MAP, &[])?;
        let graphics = GraphicsPipeline::new(&device, &cache, PAIR[0], PAIR[1], &STATE)?;
        let shape = ImageShape::plane(ash::vk::Format::R8G8B8A8_UNORM, 2, 2);
        let image = Image::with_texels(&device, "image", shape, &[vec![1; 16]])?;
        let sampler = Sampler::new(&device, "sampler", SamplerKind::Trilinear)?;
        let buffer = Buffer::with_contents(&device, "buffer", ash::vk::BufferUsageFlags::STORAGE_BUFFER, &[1; 16])?;
        let mut frames = Frames::new(&device, "frames", 2)?;
        frames.record(|commands| commands.timed_pass("nothing", |_| Ok::<_, VulkanError>(())))?;
        frames.pass_times()?;
        drop((compute, graphics, image, sampler, buffer));
        Ok(())
    }

    /// The same of a device that only compiles.
    fn compile_everything(messages: &mut Messages) -> Result<(), VulkanError> {
        let instance = Instance::new(true)?;
        *messages = instance.messages();
        let device = CompilingDevice::new(&instance, None)?;
        device.compile(&compiled::TONE_MAP, &[])?;
        device.compile(&compiled::SHADE_FITTED, &[])?;
        device.compile_graphics(PAIR[0], PAIR[1], &STATE).map(drop)
    }

    /// Lets each call of `act` fail in turn; among them are those `expected`.
    fn fail_each_call(act: impl Fn(&mut Messages) -> Result<(), VulkanError> + Sync, expected: &[&str]) {
        // Each `act` opens an instance with validation, and those do not keep drivers loaded.
        drop(Instance::new(false).expect("an instance"));
        let mut messages = Messages::default();
        let (result, calls) = with_fault(None, || act(&mut messages));
        result.expect("no call fails");
        for name in expected {
            assert!(calls.contains(name), "{name} is not among {calls:?}");
        }
        for (failing, name) in calls.iter().enumerate() {
            let mut messages = Messages::default();
            let result = ash::vk::Result::ERROR_OUT_OF_DEVICE_MEMORY;
            let fault = Fault { of: None, after: None, index: failing, result, lasts: false };
            let (result, _) = with_fault(Some(fault), || act(&mut messages));
            let error = result.expect_err("a call fails").to_string();
            assert!(error.contains(name), "{failing}, {name}: {error}");
            assert_eq!(messages.all(), Vec::<String>::new(), "call {failing}, {name}");
        }
        println!("{} calls: {calls:?}", calls.len());
    }

    #[test]
    fn whichever_call_fails_it_is_named_and_nothing_is_left() {
        let expected =
            ["vkCreateInstance", "vkCreateDevice", "vkCreateSemaphore", "vkAllocateMemory", "vkQueueSubmit2"];
        fail_each_call(use_everything, &expected);
    }

    #[test]
    fn nor_is_anything_left_of_a_device_that_only_compiles() {
        // The driver that tells of shaders without a GPU, by the names of Debian's and of newer Mesa.
        let drivers =
            ["radeon_icd.x86_64.json", "radeon_icd.json"].map(|name| format!("/usr/share/vulkan/icd.d/{name}"));
        let Some(driver) = drivers.into_iter().find(|driver| std::path::Path::new(driver).is_file()) else {
            return eprintln!("not tested: there is no such driver here");
        };
        let module = module_path!().split_once("::").expect("a crate and a module").1;
        // In a process of its own: the loader reads these once.
        let test = std::process::Command::new(std::env::current_exe().expect("a name"))
            .args([
                "--exact",
                &format!("{module}::whichever_call_of_the_null_device_fails"),
                "--ignored",
                "--nocapture",
            ])
            .env("RADV_FORCE_FAMILY", "navi21")
            .envs([("VK_DRIVER_FILES", &driver), ("VK_ICD_FILENAMES", &driver)])
            .output()
            .expect("a process");
        let said = [test.stdout, test.stderr].map(|said| String::from_utf8_lossy(&said).into_owned()).concat();
        assert!(test.status.success() && said.contains("1 passed"), "{said}");
    }

    #[test]
    #[ignore = "the test above runs it with the driver that it is about"]
    fn whichever_call_of_the_null_device_fails() {
        let expected =
            ["vkCreateDevice", "vkCreateShaderModule", "vkCreateComputePipelines", "vkCreateGraphicsPipelines"];
        fail_each_call(compile_everything, &expected);
    }

    #[test]
    fn a_planted_hazard_is_seen() {
        let (device, messages) = test_device::open_validated();
        let make = |name| {
            let usage = ash::vk::BufferUsageFlags::TRANSFER_SRC | ash::vk::BufferUsageFlags::TRANSFER_DST;
            Buffer::new(&device, name, 64, usage, BufferUse::Device).expect("a buffer")
        };
        let (source, target) = (make("source"), make("target"));
        let mut frames = Frames::new(&device, "frames", 1).expect("frames");
        // One copy is no hazard; two without a barrier between them are.
        for (copies, is_hazard) in [(1, false), (2, true)] {
            let copy = |commands: &mut Commands| (0..copies).try_for_each(|_| commands.copy_buffer(&source, &target));
            frames.record(copy).expect("a submission");
            frames.wait().expect("the end");
            let seen = messages.all();
            // Newer layers write it in lower case.
            let is_seen = seen.iter().any(|message| message.to_uppercase().contains("HAZARD"));
            assert_eq!(is_seen, is_hazard, "{copies} copies: {seen:?}");
        }
    }
}
