//! Laws of whole images: what scenes with a known answer must look like, which estimators must
//! agree, and which settings must not change a bit.

mod adaptive;
mod analytic;
mod aovs;
mod batches;
mod bits;
mod cameras;
mod clamp;
mod course;
mod denoised;
mod estimators;
mod eta;
mod faults;
mod filters;
mod footprints;
mod furnace;
mod glow;
mod invariance;
mod lens;
mod many_lights;
mod materials;
mod mattes;
mod measure;
mod media;
mod motion;
mod occlusion;
mod pbrt;
mod pictures;
mod placed;
mod replay;
mod reuse;
mod scenes;
mod specular;
mod split;
mod target;
mod textures;
