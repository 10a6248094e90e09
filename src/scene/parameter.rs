//! Parameters of a scene's materials, changed one by one.
use super::{MaterialSettings, MaterialSource, Scene};
use crate::brdf::{Brdf, set_parameter};
use crate::error::{Error, Result};

impl MaterialSettings {
    /// Its model, and the parameters of that.
    ///
    /// # Errors
    /// A file that cannot be read; a measured table, which has no parameters.
    pub fn model(&self) -> Result<(String, toml::Table)> {
        let none = || Error::input(&self.name, "has no parameters", "choose a material that is a model");
        match &self.source {
            MaterialSource::Model { model, parameters } => Ok((model.clone(), parameters.clone())),
            MaterialSource::Builtin(name) => Brdf::builtin_model(name).ok_or_else(none),
            MaterialSource::File(path) if Brdf::is_model_file(path) => Brdf::load_model(path),
            MaterialSource::File(_) | MaterialSource::Custom(_) => Err(none()),
        }
    }
}

impl Scene {
    /// The material of this name.
    ///
    /// # Errors
    /// There is none.
    pub fn material_mut(&mut self, name: &str) -> Result<&mut MaterialSettings> {
        let names: Vec<_> = self.materials.iter().map(|material| material.name.clone()).collect();
        self.materials.iter_mut().find(|material| material.name == name).ok_or_else(|| {
            let remedy = format!("name one of {}", names.join(", "));
            Error::input(format!("material \"{name}\""), "is not in the scene", remedy)
        })
    }

    /// Gives the parameter `key` of the material `name` this value. The material becomes a model with parameters of its own.
    ///
    /// # Errors
    /// No such material, a material without parameters, no such parameter, a value out of its range; then nothing is changed.
    pub fn set_parameter(&mut self, name: &str, key: &str, value: &toml::Value) -> Result<()> {
        let material = self.material_mut(name)?;
        let (model, mut parameters) = material.model()?;
        set_parameter(&mut parameters, key, value.clone());
        Brdf::from_parameters(&model, parameters.clone())
            .map_err(|error| error.within(format!("material \"{name}\"")))?;
        material.source = MaterialSource::Model { model, parameters };
        Ok(())
    }
}
