//! Tables of BRDFs in one 3D image, which shaders address by an offset.
use crate::vulkan::{self, Device, ImageKind, ImageShape};
use crate::{Error, Result};
use ash::vk;
use half::f16;
use std::sync::Arc;

/// Four half floats: every device filters these.
type Texel = [f16; 4];

/// Tables that have the same size along x and y: stacked along z, and where the device's images end there, side by side along y.
pub struct BrdfAtlas {
    /// Texels of each table along x and y.
    size: [usize; 2],
    /// The first y and z of each table, and its texels, x fastest.
    tables: Vec<([usize; 2], Arc<[Texel]>)>,
    /// Where along y and z the next one lies.
    next: [usize; 2],
}

impl BrdfAtlas {
    /// One without tables, for those that have this many texels along x and y.
    pub fn new(size: [usize; 2]) -> Self {
        Self { size, tables: Vec::new(), next: [0, 0] }
    }

    /// Adds a table; returns its offset in y and z, in texels.
    ///
    /// # Errors
    /// A larger table, or more of them, than a 3D image of the device holds.
    pub fn add(&mut self, device: &Device, texels: Arc<[Texel]>) -> Result<[usize; 2]> {
        let limit = device.limits().max_image_dimension3_d as usize;
        let depth = self.depth(&texels);
        if self.next[1] + depth > limit {
            self.next = [self.next[0] + self.size[1], 0];
        }
        if depth > limit {
            let problem = format!("has a BRDF whose table is {depth} texels deep, and this device holds {limit}");
            return Err(Error::input(
                "the scene",
                problem,
                "use a model that shaders evaluate, or a device that holds more",
            ));
        }
        if self.next[0] + self.size[1] > limit {
            let problem = format!("has more tables of BRDFs than the {} that this device holds", self.tables.len());
            return Err(Error::input("the scene", problem, "use fewer materials"));
        }
        let place = self.next;
        self.tables.push((place, texels));
        self.next[1] += depth;
        Ok(place)
    }

    /// Texels of a table along z.
    fn depth(&self, texels: &[Texel]) -> usize {
        texels.len() / (self.size[0] * self.size[1])
    }

    /// The image; a single empty texel if there is no table, since the shader's binding needs something.
    ///
    /// # Errors
    /// No device memory left.
    pub fn upload(&self, device: &Arc<Device>, name: &str) -> Result<vulkan::Image> {
        let [width, side] = self.size;
        let extent = self.tables.iter().fold([1, 1, 1], |[_, y, z], (place, texels)| {
            [width, y.max(place[0] + side), z.max(place[1] + self.depth(texels))]
        });
        let mut texels = vec![Texel::default(); extent.iter().product()];
        for ([y_0, z_0], table) in &self.tables {
            for (line, source) in table.chunks_exact(width).enumerate() {
                let start = width * (y_0 + line % side + extent[1] * (z_0 + line / side));
                texels[start..start + width].copy_from_slice(source);
            }
        }
        let format = vk::Format::R16G16B16A16_SFLOAT;
        let shape = ImageShape { format, extent: extent.map(|size| size as u32), levels: 1, kind: ImageKind::Volume };
        Ok(vulkan::Image::with_texels(device, name, shape, &[bytemuck::cast_slice(&texels).to_vec()])?)
    }
}
