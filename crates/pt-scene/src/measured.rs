//! Measured reflection: goniophotometer data, in tables whose parameterization adapts to the
//! material. [Dupuy & Jakob 2018, "An Adaptive Parameterization for Efficient Material Acquisition
//! and Rendering"]

use std::f32::consts::{FRAC_PI_2, TAU};

/// Maximum plausible value of a measurement.
const MAX: f32 = 1e9;
/// Tolerance of angles beyond a right angle or a full turn, which single precision cannot represent
/// exactly.
const SLACK: f32 = 1e-3;

/// One or several tables of values at equidistant points of the unit square, including its edges.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Planes {
    /// Number of points along x, the square root of θ over a right angle; at least 2.
    pub columns: usize,
    /// Number of points along y, which is φ from −π to π; at least 2.
    pub rows: usize,
    /// Values, ordered by table, row and column.
    pub values: Vec<f32>,
}

/// The tables of a material; [`Measurements`] checks the stated conditions. θ is the angle from the
/// normal, φ the angle around it from the direction of increasing texture coordinate u, both in
/// radians.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tables {
    /// Description by the author.
    pub description: String,
    /// θ of the directions of incidence, from 0 to π/2, increasing.
    pub theta: Vec<f32>,
    /// φ of the directions of incidence, increasing. With one or two, the material is isotropic.
    /// With more, they cover the full turn, or a half or a quarter of it from −π, which is
    /// repeated.
    pub phi: Vec<f32>,
    /// D(m), the distribution of microfacet normals per steradian.
    pub ndf: Planes,
    /// σ, the projected area of microfacets by viewing direction.
    pub sigma: Planes,
    /// Distribution of visible normals for each φ and, as the inner index, each θ: density per area
    /// of the unit square, up to a factor.
    pub vndf: Planes,
    /// Distribution of reflected luminance over visible normals: density per area of the unit
    /// square, which `vndf` warps to normals; as many tables as `vndf`, up to a factor. Where it is
    /// 0, nothing is reflected.
    pub luminance: Planes,
    /// Reflection at the points of `luminance`, in linear Rec. 709: f cos θ, or, with
    /// `is_relative`, f cos θ over D(m) / 4σ.
    pub colors: Vec<[f32; 3]>,
    /// True if `colors` must be multiplied by D(m) / 4σ.
    pub is_relative: bool,
}

/// Validated tables: sizes are consistent, all values are finite and from 0 to 10⁹, and no density
/// is 0 everywhere except that of luminance.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurements(Tables);

impl Measurements {
    /// Validates tables.
    ///
    /// # Errors
    /// Returns a message if they are inconsistent, with the name of the table in files, the value
    /// found and the value expected.
    pub fn new(tables: Tables) -> Result<Self, String> {
        check_angles("theta_i", &tables.theta, [0.0, FRAC_PI_2])?;
        check_angles("phi_i", &tables.phi, [-TAU, TAU])?;
        if tables.phi.len() > 2 && !matches!(repeats(&tables.phi), 1 | 2 | 4) {
            let [first, .., last] = tables.phi.as_slice() else { unreachable!("there are more") };
            return Err(format!(
                "found \"phi_i\" from {first} to {last}, expected a full turn, a half or a quarter"
            ));
        }
        let count = tables.theta.len() * tables.phi.len();
        for (name, planes, count) in [
            ("ndf", &tables.ndf, 1),
            ("sigma", &tables.sigma, 1),
            ("vndf", &tables.vndf, count),
            ("luminance", &tables.luminance, count),
        ] {
            check_planes(name, planes, count)?;
        }
        for (name, planes) in
            [("ndf", &tables.ndf), ("sigma", &tables.sigma), ("vndf", &tables.vndf)]
        {
            let mut planes = planes.values.chunks(planes.columns * planes.rows);
            if planes.any(|plane| plane.iter().all(|x| *x == 0.0)) {
                return Err(format!(
                    "found the field \"{name}\" with zeros only, expected a distribution"
                ));
            }
        }
        if tables.colors.len() != tables.luminance.values.len() {
            return Err(format!(
                "found {} colours, expected one for each of the {} numbers of \"luminance\"",
                tables.colors.len(),
                tables.luminance.values.len()
            ));
        }
        check_numbers("rgb", tables.colors.as_flattened())?;
        Ok(Self(tables))
    }

    /// The tables.
    pub fn tables(&self) -> &Tables {
        &self.0
    }

    /// Returns true if the material is isotropic.
    pub fn is_isotropic(&self) -> bool {
        self.0.phi.len() <= 2
    }

    /// Returns the number of repetitions of the tables around the normal: 1, 2 or 4. Two are
    /// rotated by half a turn, and four are mirrored.
    pub fn repeats(&self) -> u32 {
        if self.is_isotropic() { 1 } else { repeats(&self.0.phi) }
    }

    /// Creates tables with constant f cos θ for all directions.
    pub fn even(color: [f32; 3]) -> Self {
        let plane = || Planes { columns: 2, rows: 2, values: vec![1.0; 4] };
        Self(Tables {
            description: String::new(),
            theta: vec![0.0],
            phi: vec![0.0],
            ndf: plane(),
            sigma: plane(),
            vndf: plane(),
            luminance: plane(),
            colors: vec![color; 4],
            is_relative: false,
        })
    }

    /// Returns true if the material equals its mirror image, in which φ is −φ.
    pub fn is_mirrored(&self) -> bool {
        self.is_isotropic() || self.repeats() == 4
    }

    /// Returns the approximate roughness α of the microfacets: the θ at which D first falls to a
    /// quarter of its maximum, the smallest over all φ. GGX falls to a quarter at tan θ = α.
    pub fn roughness(&self) -> f32 {
        let Planes { columns, rows, values } = &self.0.ndf;
        let quarter = 0.25 * values.iter().fold(0.0, |most: f32, x| most.max(*x));
        let width = |row: usize| {
            let row = &values[row * columns..(row + 1) * columns];
            row.iter().position(|x| *x <= quarter).unwrap_or(columns - 1)
        };
        let least = (0..*rows).map(width).min().unwrap_or(0);
        let u = least as f32 / (columns - 1) as f32;
        (FRAC_PI_2 * u * u).min(1.0)
    }

    /// Returns the approximate reflectance as seen along the normal. Relative colours are
    /// distributed over the unit square as light is over visible normals, so that their mean is the
    /// integral of f cos θ if the normals are those of microfacets; others are treated as a diffuse
    /// surface.
    pub fn color(&self) -> [f32; 3] {
        let Tables { colors, luminance: Planes { columns, rows, .. }, is_relative, .. } = &self.0;
        let first = &colors[..columns * rows];
        let mean =
            |c: usize| first.iter().map(|x| f64::from(x[c])).sum::<f64>() / first.len() as f64;
        let whole = if *is_relative { 1.0 } else { std::f64::consts::PI };
        [0, 1, 2].map(|c| (mean(c) * whole).min(1.0) as f32)
    }

    /// Returns the memory in bytes.
    pub fn bytes(&self) -> usize {
        let Tables { ndf, sigma, vndf, luminance, colors, .. } = &self.0;
        let planes =
            [ndf, sigma, vndf, luminance].map(|planes| size_of_val(planes.values.as_slice()));
        planes.iter().sum::<usize>() + size_of_val(colors.as_slice())
    }
}

/// Returns the number of these angles in a full turn.
fn repeats(phi: &[f32]) -> u32 {
    let span = phi.last().zip(phi.first()).map_or(TAU, |(last, first)| last - first);
    (TAU / span).round() as u32
}

fn check_angles(name: &str, angles: &[f32], [least, most]: [f32; 2]) -> Result<(), String> {
    if angles.is_empty() {
        return Err(format!("found no angle in the field \"{name}\", expected at least one"));
    }
    let range = least - SLACK..=most + SLACK;
    if let Some(angle) = angles.iter().find(|angle| !range.contains(*angle)) {
        return Err(format!(
            "found the angle {angle} in the field \"{name}\", expected radians from {least} to \
             {most}"
        ));
    }
    match angles.windows(2).find(|two| two[0] >= two[1]) {
        None => Ok(()),
        Some(two) => Err(format!(
            "field \"{name}\": found angle {} after {}, expected increasing angles",
            two[1], two[0]
        )),
    }
}

fn check_planes(name: &str, planes: &Planes, count: usize) -> Result<(), String> {
    let Planes { columns, rows, values } = planes;
    if *columns < 2 || *rows < 2 {
        return Err(format!(
            "found planes of {columns} x {rows} numbers in the field \"{name}\", expected at least \
             2 x 2"
        ));
    }
    let expected = columns.checked_mul(*rows).and_then(|plane| plane.checked_mul(count));
    if expected != Some(values.len()) {
        return Err(format!(
            "field \"{name}\": found {} numbers, expected {count} planes of {columns} x {rows}",
            values.len()
        ));
    }
    check_numbers(name, values)
}

fn check_numbers(name: &str, numbers: &[f32]) -> Result<(), String> {
    match numbers.iter().position(|x| !(0.0..=MAX).contains(x)) {
        None => Ok(()),
        Some(i) => Err(format!(
            "field \"{name}\": found {} as number {i}, expected 0 to {MAX:e}",
            numbers[i]
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tables of 2 × 2 values.
    fn small() -> Tables {
        let planes = |count: usize| Planes { columns: 2, rows: 2, values: vec![1.0; 4 * count] };
        Tables {
            theta: vec![0.0, 1.5],
            phi: vec![0.0],
            ndf: planes(1),
            sigma: planes(1),
            vndf: planes(2),
            luminance: planes(2),
            colors: vec![[0.5; 3]; 8],
            is_relative: true,
            ..Tables::default()
        }
    }

    fn error(change: impl FnOnce(&mut Tables)) -> String {
        let mut tables = small();
        change(&mut tables);
        Measurements::new(tables).unwrap_err()
    }

    #[test]
    fn what_does_not_fit_is_reported() {
        assert!(Measurements::new(small()).is_ok());
        let cases = [
            (error(|t| t.theta.clear()), "no angle in the field \"theta_i\""),
            (
                error(|t| t.theta[1] = 2.0),
                "the angle 2 in the field \"theta_i\", expected radians from 0 to 1.57",
            ),
            (error(|t| t.theta[0] = f32::NAN), "the angle NaN in the field \"theta_i\""),
            (error(|t| t.theta.swap(0, 1)), "\"theta_i\": found angle 0 after 1.5"),
            (error(|t| t.phi = vec![0.0, 1.0, 2.0]), "\"phi_i\" from 0 to 2, expected a full turn"),
            (error(|t| t.ndf.columns = 1), "planes of 1 x 2 numbers in the field \"ndf\""),
            (
                error(|t| t.vndf.values.truncate(4)),
                "\"vndf\": found 4 numbers, expected 2 planes of 2 x 2",
            ),
            (error(|t| t.vndf.columns = usize::MAX), "\"vndf\": found 8 numbers"),
            (error(|t| t.vndf.values[4..].fill(0.0)), "\"vndf\" with zeros only"),
            (error(|t| t.sigma.values[3] = -1.0), "found -1 as number 3, expected 0 to 1e9"),
            (
                error(|t| t.luminance.values[7] = f32::INFINITY),
                "\"luminance\": found inf as number 7",
            ),
            (error(|t| t.colors.truncate(3)), "found 3 colours, expected one for each of the 8"),
            (error(|t| t.colors[1][2] = f32::NAN), "\"rgb\": found NaN as number 5"),
        ];
        for (message, want) in cases {
            assert!(message.contains(want), "{message}, expected {want}");
        }
    }

    #[test]
    fn turns_are_repeated() {
        let turned = |phi: Vec<f32>| {
            let count = 2 * phi.len();
            let planes = Planes { columns: 2, rows: 2, values: vec![1.0; 4 * count] };
            let colors = vec![[0.5; 3]; 4 * count];
            let tables = Tables { phi, vndf: planes.clone(), luminance: planes, colors, ..small() };
            Measurements::new(tables).unwrap()
        };
        let pi = std::f32::consts::PI;
        for (phi, repeats) in [
            (vec![-pi, 0.0, pi], 1),
            (vec![-pi, -2.0, 0.0], 2),
            (vec![-pi, -2.0, -0.5 * pi], 4),
            (vec![0.0, 3.0], 1),
        ] {
            assert_eq!(turned(phi).repeats(), repeats);
        }
    }
}
