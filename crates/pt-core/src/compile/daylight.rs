//! Compiles daylight: skies and their suns.

use std::sync::Arc;

use pt_math::{DVec3, Mat3, Spectrum, Vec3};
use pt_scene::image::Image;
use pt_scene::{Daylight, Rows, TimeRange};

use super::lights::Lights;
use crate::light::{
    DistantDisk, EnvironmentMap, HosekWilkieModel, HosekWilkieSky, LimbDarkening, Sun,
    hosek_wilkie, mean_daylight,
};

/// Maximum number of means of daylight over days, each of which takes a fifth of a second.
const MAX_MEANS: usize = 8;

impl Lights {
    /// Adds the sun and the sky, in axes with +y up. Returns a note if the sun is below the
    /// horizon.
    pub(super) fn add_daylight(
        &mut self,
        light: &Daylight,
        turn: Mat3,
    ) -> Result<Option<String>, String> {
        let mut to_sun = light.check()?;
        if let Some(span) = &light.span {
            if span.part[0] < span.part[1] {
                self.means += 1;
                if self.means > MAX_MEANS {
                    return Err(format!(
                        "more than {MAX_MEANS} daylights over time ranges; combine them"
                    ));
                }
                self.add_mean_daylight(light, span, turn);
                return Ok(None);
            }
            to_sun = span.to_sun(0.0);
        }
        if to_sun.y < 0.0 {
            return Ok(Some("the sun is below the horizon; the sky is black".into()));
        }
        if light.sky > 0.0 {
            let to_sun = to_sun.as_vec3();
            let model = HosekWilkieModel::new(to_sun, light.turbidity, light.albedo, light.sky);
            let index = self.tables.clear_skies.len() as u32;
            self.tables.clear_skies.push(model);
            self.add_sky(HosekWilkieSky { index, to_world: turn });
        }
        if light.sun > 0.0 {
            let limb = self.limb(light);
            let mut sun = sun_of(light, limb, to_sun);
            sun.disk.to_light = (turn * to_sun.as_vec3()).normalize();
            self.add_sky(Sun { up: turn.y_axis, ..sun });
        }
        Ok(None)
    }

    /// Adds the table of limb darkening of the sun, and returns its index; `None` without limb
    /// darkening.
    fn limb(&mut self, light: &Daylight) -> Option<u32> {
        let limb = light.limb_darkening.then_some(self.tables.limbs.len() as u32);
        self.tables.limbs.extend(limb.map(|_| LimbDarkening::new(light.turbidity)));
        limb
    }

    /// Adds the means of the sky and of the sun over a time span.
    fn add_mean_daylight(&mut self, light: &Daylight, span: &TimeRange, turn: Mat3) {
        let add = |lights: &mut Self, image: Image| {
            let map = EnvironmentMap::of_image(Arc::new(image), Rows::PixelCenters);
            lights.add_map(map, Spectrum::ONE, turn);
        };
        if light.sky > 0.0 {
            add(self, mean_daylight::sky(light, span));
        }
        if light.sun > 0.0 {
            let limb = self.limb(light);
            let sun = mean_daylight::sun(span, &self.tables, |d| sun_of(light, limb, d));
            add(self, sun);
        }
    }
}

/// The sun in a unit direction, in axes with +y up. Its irradiance is that of the real sun for any
/// angular diameter.
fn sun_of(light: &Daylight, limb: Option<u32>, to_sun: DVec3) -> Sun {
    let radius = 0.5 * light.aperture.to_radians();
    let half_sines = [hosek_wilkie::SUN_RADIUS, radius].map(|r| libm::sin(0.5 * r));
    let ratio = half_sines[0] / half_sines[1];
    let scale = f64::from(light.sun) * ratio * ratio;
    let radiance = match limb {
        Some(_) => [1.0; 3],
        None => hosek_wilkie::sun(libm::asin(to_sun.y.clamp(0.0, 1.0)), light.turbidity),
    };
    let radiance = radiance.map(|c| (c * scale) as f32);
    let disk =
        DistantDisk::of_radiance(to_sun.as_vec3().normalize(), radius as f32, radiance.into());
    Sun { disk, up: Vec3::Y, limb }
}
