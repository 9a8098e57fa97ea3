//! `measured`: files of measured materials.

use pt_scene::Surface;
use pt_scene::material::Measured;

use super::super::object::error;
use super::inputs::Inputs;
use crate::LoadError;
use crate::shared::context::Unusable;
use crate::shared::placeholder;

/// Reads a measured material, which is one-sided. A missing file is replaced by a placeholder.
pub(super) fn measured(inputs: &mut Inputs<'_, '_>) -> Result<Surface, LoadError> {
    let tree = inputs.textures.tree;
    let parameters = &mut inputs.parameters;
    let Some(text) = parameters.text("filename")? else {
        return Err(error(&inputs.object.at, "missing <string name=\"filename\">"));
    };
    let path = tree.resolve(text).ok_or_else(|| Unusable::Missing(tree.not_found(text)));
    match path.and_then(|path| tree.context.measurements(&path)) {
        Ok(measurements) => Ok(Measured { measurements, two_sided: false }.into()),
        Err(Unusable::Broken(why)) => Err(parameters.refuse("filename", why)),
        Err(Unusable::Missing(why)) => {
            tree.miss(parameters.place("filename"), &why, placeholder::INSTEAD)?;
            tree.context.set_placeholder_used();
            Ok(placeholder::surface())
        }
    }
}
