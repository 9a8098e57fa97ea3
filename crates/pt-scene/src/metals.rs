//! Named metals and other conductors.

/// A conductor with the complex index of refraction η + ik, for red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metal {
    /// Chemical symbol, as Mitsuba 3 writes it.
    pub name: &'static str,
    /// Real part.
    pub eta: [f32; 3],
    /// Imaginary part.
    pub k: [f32; 3],
    /// True if Mitsuba also accepts the name with the suffix `_palik`.
    pub palik: bool,
}

impl Metal {
    /// Returns the metal of a name, or `None` if it is unknown.
    pub fn named(name: &str) -> Option<Self> {
        let first = name.strip_suffix("_palik");
        let is_it = |m: &&Self| m.name == name || (m.palik && Some(m.name) == first);
        METALS.iter().find(is_it).copied()
    }
}

const fn metal(name: &'static str, eta: [f32; 3], k: [f32; 3]) -> Metal {
    Metal { name, eta, k, palik: false }
}

const fn palik(name: &'static str, eta: [f32; 3], k: [f32; 3]) -> Metal {
    Metal { name, eta, k, palik: true }
}

/// Conductors by name: the measured spectra of Mitsuba 3.9, in linear sRGB as Mitsuba converts
/// them, to four decimals. Channels that became negative by the conversion are 0.
///
/// Brass (CuZn), which Mitsuba does not have, is that of pbrt-v4 at 630, 530 and 450 nm.
///
/// Mitsuba has neither cobalt, iron, palladium and titanium nor nickel by its symbol alone: they
/// are from Johnson & Christy 1974, "Optical constants of transition metals", and converted in the
/// same way as spectra in Mitsuba files are by this program.
pub const METALS: &[Metal] = &[
    metal("a-C", [2.944, 2.2271, 1.9682], [0.8875, 0.7993, 0.8153]),
    metal("Ag", [0.1553, 0.1167, 0.1384], [4.8284, 3.1222, 2.1469]),
    metal("Al", [1.6575, 0.8804, 0.5212], [9.2238, 6.2695, 4.837]),
    palik("AlAs", [3.6053, 3.2329, 2.2163], [0.0007, 0.0, 0.0075]),
    palik("AlSb", [0.0, 4.1394, 4.6693], [0.0, 0.094, 1.3006]),
    metal("Au", [0.143, 0.3753, 1.442], [3.983, 2.3856, 1.6034]),
    palik("Be", [4.185, 3.185, 2.7841], [3.8355, 3.0101, 2.869]),
    metal("Co", [2.2479, 2.0303, 1.7072], [4.2136, 3.7865, 3.2289]),
    metal("Cr", [4.3697, 2.9165, 1.6549], [5.2065, 4.2313, 3.7547]),
    palik("CsI", [2.1449, 1.7023, 1.6624], [0.0, 0.0, 0.0]),
    metal("Cu", [0.201, 0.9237, 1.1022], [3.9133, 2.453, 2.1421]),
    metal("Cu_palik", [0.2132, 0.9197, 1.1024], [3.9219, 2.4573, 2.1366]),
    palik("Cu2O", [3.5518, 2.9499, 2.7519], [0.1142, 0.1939, 0.6061]),
    palik("CuO", [3.2475, 2.4478, 2.2102], [0.5211, 0.57, 0.7222]),
    metal("CuZn", [0.445, 0.573, 1.094], [3.522, 2.568, 1.829]),
    palik("d-C", [2.7087, 2.3188, 2.2289], [0.0, 0.0, 0.0]),
    metal("Fe", [2.9213, 2.9137, 2.5421], [3.0731, 2.9338, 2.7465]),
    palik("Hg", [2.3989, 1.44, 0.9096], [6.3276, 4.3719, 3.4218]),
    palik("HgTe", [4.779, 3.2312, 2.6599], [1.6316, 1.5808, 1.7293]),
    palik("Ir", [3.0863, 2.0822, 1.6179], [5.5922, 4.0671, 3.2673]),
    palik("K", [0.064, 0.0464, 0.0382], [2.1042, 1.3489, 0.9131]),
    palik("Li", [0.2658, 0.1956, 0.2209], [3.5402, 2.3111, 1.6686]),
    palik("MgO", [2.0896, 1.6507, 1.5949], [0.0, 0.0, 0.0]),
    palik("Mo", [4.484, 3.5251, 2.7763], [4.1114, 3.4208, 3.1506]),
    metal("Na_palik", [0.0603, 0.0561, 0.062], [3.1793, 2.1125, 1.579]),
    palik("Nb", [3.4201, 2.7901, 2.3956], [3.4414, 2.7377, 2.5797]),
    metal("Ni", [2.0202, 1.899, 1.7223], [4.1684, 3.5604, 2.882]),
    metal("Ni_palik", [2.3673, 1.6634, 1.4671], [4.4988, 3.0502, 2.3454]),
    metal("Pd", [1.7859, 1.6178, 1.3904], [4.3404, 3.803, 3.2009]),
    palik("Rh", [2.5858, 1.8602, 1.5543], [6.7823, 4.703, 3.9761]),
    palik("Se", [4.0583, 2.8429, 2.8209], [0.754, 0.6384, 0.5218]),
    palik("Se-e", [5.7228, 4.1657, 4.0813], [0.8711, 1.1052, 1.5653]),
    palik("SiC", [3.1723, 2.526, 2.4794], [0.0, 0.0, 0.0]),
    palik("SnTe", [4.5242, 1.9816, 1.2816], [0.0, 0.0, 0.0]),
    palik("Ta", [2.0627, 2.3929, 2.6279], [2.4084, 1.7415, 1.947]),
    palik("Te", [7.3902, 4.4821, 2.6371], [3.256, 3.5271, 3.2921]),
    palik("Te-e", [7.5089, 4.2964, 2.37], [5.5839, 4.9472, 3.9976]),
    palik("ThF4", [1.8307, 1.4422, 1.3876], [0.0, 0.0, 0.0]),
    metal("Ti", [2.7341, 2.5044, 2.2335], [3.824, 3.3934, 3.0063]),
    palik("TiC", [3.7005, 2.8374, 2.5823], [3.2656, 2.3516, 2.1728]),
    palik("TiN", [1.6484, 1.1505, 1.3798], [3.3683, 1.9435, 1.1021]),
    palik("TiO2", [3.4566, 2.8017, 2.9052], [0.0001, 0.0, 0.0007]),
    palik("TiO2-e", [3.1066, 2.5132, 2.5824], [0.0, 0.0, 0.0002]),
    palik("VC", [3.6576, 2.7527, 2.5327], [3.0683, 2.1987, 1.9632]),
    metal("V_palik", [4.2776, 3.5129, 2.7611], [3.4913, 2.8895, 3.1115]),
    palik("VN", [2.8656, 2.1192, 1.9401], [3.0322, 2.0561, 1.6163]),
    metal("W", [4.3708, 3.3002, 2.9984], [3.5006, 2.6049, 2.2732]),
];
