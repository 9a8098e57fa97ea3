//! Luminous intensity distributions of luminaires.

/// Luminous intensity by direction, type C: vertical angles are measured from straight down,
/// horizontal angles around the vertical axis.
#[derive(Clone, Debug, PartialEq)]
pub struct IesProfile {
    /// Vertical angles: degrees from straight down, increasing.
    vertical: Vec<f32>,
    /// Horizontal angles: degrees, increasing from 0 to 360.
    horizontal: Vec<f32>,
    /// Candela, with the vertical angle as the inner index.
    candela: Vec<f32>,
}

impl IesProfile {
    /// Creates a profile from a table: vertical angles in degrees, increasing; horizontal angles in
    /// degrees, increasing from 0 to 360; and the intensities, with the vertical angle as the inner
    /// index.
    pub fn of_table(vertical: Vec<f32>, horizontal: Vec<f32>, candela: Vec<f32>) -> Self {
        debug_assert_eq!(candela.len(), vertical.len() * horizontal.len());
        Self { vertical, horizontal, candela }
    }

    /// Returns vertical angles, horizontal angles and intensities, as passed to [`Self::of_table`].
    pub fn table(&self) -> (&[f32], &[f32], &[f32]) {
        (&self.vertical, &self.horizontal, &self.candela)
    }

    /// Creates a profile with rotational symmetry from increasing vertical angles in degrees and
    /// their intensities.
    pub fn around_axis(vertical: Vec<f32>, candela: Vec<f32>) -> Self {
        let candela = [candela.clone(), candela].concat();
        Self::of_table(vertical, vec![0.0, 360.0], candela)
    }

    /// Returns the mean of the entries of the table, in candela, an approximation of the
    /// brightness.
    pub fn mean_candela(&self) -> f32 {
        self.candela.iter().sum::<f32>() / self.candela.len() as f32
    }

    /// Returns the candela at a vertical angle in [0, 180] and a horizontal angle in [0, 360], in
    /// degrees: linear between the angles of the table, and 0 outside their range.
    pub fn candela(&self, vertical: f32, horizontal: f32) -> f32 {
        let (Some((v, a)), Some((h, b))) =
            (between(&self.vertical, vertical), between(&self.horizontal, horizontal))
        else {
            return 0.0;
        };
        let n = self.vertical.len();
        let value = |h: usize, v: usize| self.candela[h * n + v.min(n - 1)];
        let along = |h: usize| value(h, v) * (1.0 - a) + value(h, v + 1) * a;
        along(h) * (1.0 - b) + along((h + 1).min(self.horizontal.len() - 1)) * b
    }
}

/// Returns the index of the last angle that is not above `x`, and the fraction of the interval up
/// to the next one; `None` outside the range.
fn between(angles: &[f32], x: f32) -> Option<(usize, f32)> {
    let i = angles.partition_point(|&a| a <= x).checked_sub(1)?;
    match angles.get(i + 1) {
        Some(next) => Some((i, (x - angles[i]) / (next - angles[i]))),
        None => (x <= angles[i]).then_some((i, 0.0)),
    }
}
