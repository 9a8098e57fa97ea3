//! Files of measured materials (`.bsdf`): tensor files with the fields of the RGL. [Dupuy & Jakob
//! 2018]

use pt_scene::measured::{Measurements, Planes, Tables};

use super::tensor::{OutField, TensorFile, write as write_tensors};
use crate::shared::spectra;

/// Name of the field of reflection by wavelength.
const SPECTRA: &str = "spectra";
/// Name of the field of reflection in linear Rec. 709.
const COLORS: &str = "rgb";

/// Parses the tables of a file. Spectra are converted to colours as those of reflectances are,
/// under D65: three channels are then interpolated instead of 195 wavelengths, with the same result
/// since the conversion is linear, except that negative channels, of colours outside of Rec. 709,
/// become 0 at the points of the table, so that no light is subtracted. Negative values of
/// `luminance` become 0, as noise of the measurement.
///
/// # Errors
/// Returns a message if the format is another one, a field is missing or inconsistent with others,
/// or a value is invalid. The caller adds the location of the reference in the scene.
pub(super) fn parse(bytes: &[u8]) -> Result<Measurements, String> {
    let file = TensorFile::parse(bytes)?;
    let ([_], theta) = file.floats("theta_i")?;
    let ([_], phi) = file.floats("phi_i")?;
    let counts = [phi.len(), theta.len()];
    if let Some(i) = counts.iter().position(|count| *count == 0) {
        let name = ["phi_i", "theta_i"][i];
        return Err(format!("found no angle in the field \"{name}\", expected at least one"));
    }
    let mut luminance = planes_of(&file, "luminance", counts)?;
    for number in luminance.values.iter_mut().filter(|x| **x < 0.0) {
        *number = 0.0;
    }
    let size = [luminance.rows, luminance.columns];
    let colors = if file.has(SPECTRA) {
        let ([_], wavelengths) = file.floats("wavelengths")?;
        let weights = spectra::reflectance_weights(&wavelengths)
            .map_err(|why| format!("invalid field \"wavelengths\": {why}"))?;
        colors(&file, SPECTRA, counts, size, &weights)?
    } else {
        let channels = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        colors(&file, COLORS, counts, size, &channels)?
    };
    let is_relative = match file.bytes("jacobian")? {
        [0] => false,
        [1] => true,
        other => {
            return Err(format!(
                "found {other:?} in the field \"jacobian\", expected one number, 0 or 1"
            ));
        }
    };
    Measurements::new(Tables {
        description: String::from_utf8_lossy(file.bytes("description")?).into_owned(),
        theta,
        phi,
        ndf: plane(&file, "ndf")?,
        sigma: plane(&file, "sigma")?,
        vndf: planes_of(&file, "vndf", counts)?,
        luminance,
        colors,
        is_relative,
    })
}

fn plane(file: &TensorFile<'_>, name: &str) -> Result<Planes, String> {
    let ([rows, columns], values) = file.floats(name)?;
    Ok(Planes { columns, rows, values })
}

/// Reads one table for each φ and θ.
fn planes_of(file: &TensorFile<'_>, name: &str, counts: [usize; 2]) -> Result<Planes, String> {
    let ([phi, theta, rows, columns], values) = file.floats(name)?;
    check_counts(name, [phi, theta], counts)?;
    Ok(Planes { columns, rows, values })
}

fn check_counts(name: &str, found: [usize; 2], counts: [usize; 2]) -> Result<(), String> {
    if found == counts {
        return Ok(());
    }
    let ([a, b], [phi, theta]) = (found, counts);
    Err(format!(
        "found {a} x {b} directions in the field \"{name}\", expected {phi} x {theta} as in \
         \"phi_i\" and \"theta_i\""
    ))
}

/// Sums channels times their weights to colours.
fn colors(
    file: &TensorFile<'_>,
    name: &str,
    counts: [usize; 2],
    size: [usize; 2],
    weights: &[[f64; 3]],
) -> Result<Vec<[f32; 3]>, String> {
    let ([phi, theta, channels, rows, columns], values) = file.floats(name)?;
    check_counts(name, [phi, theta], counts)?;
    if channels != weights.len() || [rows, columns] != size {
        return Err(format!(
            "found {channels} planes of {rows} x {columns} per direction in the field \"{name}\", \
             expected {} of {} x {}",
            weights.len(),
            size[0],
            size[1]
        ));
    }
    if let Some(i) = values.iter().position(|x| !x.is_finite()) {
        let bad = values[i];
        return Err(format!(
            "found {bad} as number {i} of the field \"{name}\", expected a finite number"
        ));
    }
    let plane = rows * columns;
    if plane == 0 {
        return Ok(Vec::new());
    }
    let of_point = |planes: &[f32], point: usize| {
        let mut sum = [0.0; 3];
        for (value, weight) in planes[point..].iter().step_by(plane).zip(weights) {
            for (sum, weight) in sum.iter_mut().zip(weight) {
                *sum += f64::from(*value) * weight;
            }
        }
        sum.map(|channel| channel.max(0.0) as f32)
    };
    let directions = values.chunks(plane * channels);
    Ok(directions.flat_map(|planes| (0..plane).map(move |point| of_point(planes, point))).collect())
}

/// Encodes the tables as a file, with colours instead of spectra.
pub(super) fn write(measurements: &Measurements) -> Vec<u8> {
    let tables = measurements.tables();
    let [phi, theta] = [tables.phi.len(), tables.theta.len()];
    let Planes { rows, columns, .. } = tables.luminance;
    let directions = tables.colors.chunks(rows * columns);
    let channels =
        directions.flat_map(|points| (0..3).flat_map(|c| points.iter().map(move |p| p[c])));
    let mut fields = fields_but_colors(tables);
    fields.push(OutField::floats(COLORS, &[phi, theta, 3, rows, columns], channels));
    write_tensors(&fields)
}

/// Returns all fields except that of the reflection.
fn fields_but_colors(tables: &Tables) -> Vec<OutField<'static>> {
    let [phi, theta] = [tables.phi.len(), tables.theta.len()];
    let plane = |name, Planes { rows, columns, values }: &Planes| {
        OutField::floats(name, &[*rows, *columns], values.iter().copied())
    };
    let planes = |name, Planes { rows, columns, values }: &Planes| {
        OutField::floats(name, &[phi, theta, *rows, *columns], values.iter().copied())
    };
    vec![
        OutField::bytes("description", tables.description.as_bytes()),
        list("theta_i", &tables.theta),
        list("phi_i", &tables.phi),
        plane("ndf", &tables.ndf),
        plane("sigma", &tables.sigma),
        planes("vndf", &tables.vndf),
        planes("luminance", &tables.luminance),
        OutField::bytes("jacobian", &[u8::from(tables.is_relative)]),
    ]
}

fn list(name: &'static str, values: &[f32]) -> OutField<'static> {
    OutField::floats(name, &[values.len()], values.iter().copied())
}

#[cfg(test)]
mod tests {
    use super::super::tensor;
    use super::*;

    const WAVELENGTHS: [f32; 3] = [490.0, 510.0, 530.0];

    /// Returns the fields of a small file whose spectra are `spectrum` times a factor per point.
    fn fields(spectrum: [f32; 3]) -> Vec<OutField<'static>> {
        let planes = |name, counts: &[usize]| {
            let count = counts.iter().product();
            OutField::floats(name, counts, std::iter::repeat_n(1.0, count))
        };
        let points = (0..2_u8).flat_map(move |direction| {
            spectrum.into_iter().flat_map(move |value| {
                (0..6_u8).map(move |point| value * f32::from(6 * direction + point))
            })
        });
        vec![
            OutField::bytes("description", b"a test"),
            OutField::floats("theta_i", &[2], [0.0, 1.5].into_iter()),
            OutField::floats("phi_i", &[1], [0.0].into_iter()),
            planes("ndf", &[2, 4]),
            planes("sigma", &[3, 2]),
            planes("vndf", &[1, 2, 4, 2]),
            planes("luminance", &[1, 2, 3, 2]),
            OutField::floats("wavelengths", &[3], WAVELENGTHS.into_iter()),
            OutField::floats("spectra", &[1, 2, 3, 3, 2], points),
            OutField::bytes("jacobian", &[1]),
        ]
    }

    /// Returns the message about a file in which one field is replaced.
    fn error(other: OutField<'static>) -> String {
        let mut fields = fields([1.0; 3]);
        fields.retain(|field| field.name() != other.name());
        fields.push(other);
        parse(&tensor::write(&fields)).unwrap_err()
    }

    #[test]
    fn spectra_become_colours_of_each_point() {
        let spectrum = [0.2, 0.5, 0.9];
        let read = parse(&tensor::write(&fields(spectrum))).unwrap();
        let tables = read.tables();
        assert_eq!((tables.vndf.columns, tables.vndf.rows), (2, 4));
        assert_eq!((tables.ndf.columns, tables.ndf.rows), (4, 2));
        let weights = spectra::reflectance_weights(&WAVELENGTHS).unwrap();
        for (point, color) in tables.colors.iter().enumerate() {
            for c in 0..3 {
                let sum: f64 =
                    weights.iter().zip(spectrum).map(|(w, value)| w[c] * f64::from(value)).sum();
                let expected = sum * point as f64;
                assert!((f64::from(color[c]) - expected).abs() < 1e-5, "{point}: {color:?}");
            }
        }
    }

    /// A colour outside of Rec. 709 has negative channels, which become 0.
    #[test]
    fn no_channel_takes_light_away() {
        let read = parse(&tensor::write(&fields([0.0, 1.0, 0.0]))).unwrap();
        let weights = spectra::reflectance_weights(&WAVELENGTHS).unwrap();
        assert!(weights[1].iter().any(|c| *c < 0.0), "{weights:?}");
        assert!(read.tables().colors.as_flattened().iter().all(|c| *c >= 0.0));
    }

    #[test]
    fn what_is_written_is_read() {
        let read = parse(&tensor::write(&fields([0.2, 0.5, 0.9]))).unwrap();
        assert_eq!(parse(&write(&read)).unwrap(), read);
    }

    #[test]
    fn noise_of_the_luminance_is_none() {
        let values = [1.0, -1e-6, 1.0, 1.0, 1.0, 1.0].repeat(2);
        let mut fields = fields([1.0; 3]);
        fields.retain(|field| field.name() != "luminance");
        fields.push(OutField::floats("luminance", &[1, 2, 3, 2], values.into_iter()));
        let read = parse(&tensor::write(&fields)).unwrap();
        assert_eq!(read.tables().luminance.values[1], 0.0);
    }

    #[test]
    fn what_makes_no_sense_is_reported() {
        let floats = |name, shape: &[usize], value: f32| {
            OutField::floats(name, shape, std::iter::repeat_n(value, shape.iter().product()))
        };
        let cases = [
            (floats("theta_i", &[0], 0.0), "no angle in the field \"theta_i\""),
            (floats("phi_i", &[1, 1], 0.0), "\"phi_i\": found float32 of 1 x 1"),
            (floats("vndf", &[2, 1, 4, 2], 1.0), "found 2 x 1 directions in the field \"vndf\""),
            (floats("luminance", &[1, 2, 1, 2], 1.0), "3 planes of 3 x 2"),
            (
                floats("spectra", &[1, 2, 2, 3, 2], 1.0),
                "2 planes of 3 x 2 per direction in the field \"spectra\", expected 3",
            ),
            (
                floats("spectra", &[1, 2, 3, 3, 2], f32::NAN),
                "found NaN as number 0 of the field \"spectra\"",
            ),
            (floats("wavelengths", &[3], 500.0), "\"wavelengths\": found wavelength 500 after 500"),
            (floats("ndf", &[2, 4], -1.0), "\"ndf\": found -1 as number 0"),
            (floats("luminance", &[1, 2, 0, 1 << 40], 1.0), "3 planes of 3 x 2"),
            (OutField::bytes("jacobian", &[2]), "found [2] in the field \"jacobian\""),
            (OutField::bytes("jacobian", &[]), "found [] in the field \"jacobian\""),
        ];
        for (field, want) in cases {
            let message = error(field);
            assert!(message.contains(want), "{message}, expected {want}");
        }
    }

    #[test]
    fn planes_without_directions_are_no_planes() {
        let endless = [0, 2, 1 << 40, 1 << 40];
        let none = |name, shape: &[usize]| OutField::floats(name, shape, std::iter::empty());
        let mut fields = fields([1.0; 3]);
        fields.retain(|field| !["phi_i", "luminance", "vndf", "spectra"].contains(&field.name()));
        fields.push(none("phi_i", &[0]));
        fields.extend(["luminance", "vndf"].map(|name| none(name, &endless)));
        fields.push(none("spectra", &[0, 2, 3, 1 << 40, 1 << 40]));
        let message = parse(&tensor::write(&fields)).unwrap_err();
        assert!(message.contains("no angle in the field \"phi_i\""), "{message}");
    }

    const SCENES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes");

    /// Returns the file of the Mitsuba scene by wavelengths, as pbrt-v4 requires it: blue up to 480
    /// nm, green at 550 nm and red from 610 nm.
    fn by_wavelengths(measurements: &Measurements) -> Vec<u8> {
        const CHANNELS: [(f32, usize); 5] =
            [(360.0, 2), (480.0, 2), (550.0, 1), (610.0, 0), (830.0, 0)];
        let tables = measurements.tables();
        let [phi, theta] = [tables.phi.len(), tables.theta.len()];
        let Planes { rows, columns, .. } = tables.luminance;
        let mut fields = fields_but_colors(tables);
        let spectra = tables.colors.chunks(rows * columns).flat_map(|points| {
            CHANNELS.iter().flat_map(move |(_, c)| points.iter().map(move |point| point[*c]))
        });
        let shape = [phi, theta, CHANNELS.len(), rows, columns];
        fields.push(list("wavelengths", &CHANNELS.map(|(nanometres, _)| nanometres)));
        fields.push(OutField::floats(SPECTRA, &shape, spectra));
        tensor::write(&fields)
    }

    /// The file of a pbrt-v4 scene has spectra, whose colours equal the original ones within 15 %.
    /// `PT_WRITE_GENERATED=1` writes it.
    #[test]
    fn the_file_of_a_scene_has_spectra() {
        let colors =
            std::fs::read(format!("{SCENES}/mitsuba/gloss.bsdf")).expect("the file exists");
        let colors = parse(&colors).unwrap();
        let path = format!("{SCENES}/pbrt/gloss.bsdf");
        let bytes = by_wavelengths(&colors);
        if std::env::var_os("PT_WRITE_GENERATED").is_some() {
            std::fs::write(&path, &bytes).expect("a writable folder");
        }
        assert!(bytes == std::fs::read(&path).expect("the file exists"));
        let spectra = parse(&bytes).unwrap();
        let pairs = spectra.tables().colors.iter().zip(&colors.tables().colors);
        let mean = |of: fn([f32; 3], [f32; 3]) -> f32| {
            pairs.clone().map(|(a, b)| f64::from(of(*a, *b))).sum::<f64>()
        };
        let apart = mean(|a, b| (0..3).map(|c| (a[c] - b[c]).abs()).sum());
        let whole = mean(|_, b| b.iter().sum());
        assert!(apart < 0.15 * whole, "{}", apart / whole);
    }
}
