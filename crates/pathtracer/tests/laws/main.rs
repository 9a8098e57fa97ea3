//! Tests of whole images: scenes with a known solution, estimators that must agree, and settings
//! that must not change a bit.

/// Makes an enum of kinds of which a crate has a list, such as `pt_scene::surfaces!`, and a list of
/// its variants. Laws over all kinds match it exhaustively.
macro_rules! kinds {
    ($($name:ident),*) => {
        #[derive(Clone, Copy)]
        pub(crate) enum Kind {
            $($name),*
        }
        pub(crate) const KINDS: &[Kind] = &[$(Kind::$name),*];
    };
}

mod adaptive;
mod alpha;
mod analytic;
mod aovs;
mod batches;
mod bits;
mod cameras;
mod cases;
mod clamp;
mod course;
mod denoised;
mod distances;
mod editing;
mod emission;
mod estimators;
mod eta;
mod faults;
mod filters;
mod footprints;
mod furnace;
mod gltf;
mod hair;
mod hidden;
mod hierarchies;
mod image_motion;
mod invariance;
mod leaks;
mod lens;
mod light_groups;
mod many_lights;
mod materials;
mod mattes;
mod measure;
mod measured;
mod media;
mod media_invariance;
mod meters;
mod motion;
mod no_area;
mod occlusion;
mod parts;
mod pbrt;
mod pictures;
mod placed;
mod points;
mod portal;
mod reference;
mod reliefs;
mod replay;
mod reuse;
mod scenes;
mod sides;
mod space;
mod specular;
mod split;
mod straight;
mod target;
mod terminator;
mod textures;
mod vacant;
mod views;
