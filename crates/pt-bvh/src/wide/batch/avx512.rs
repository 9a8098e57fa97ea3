//! AVX-512 kernels, if the processor supports them: detection, loads and stores of sixteen numbers,
//! and the triangle test of packets, one triangle against sixteen rays. The operations are those of
//! [`ShearedTriangles`](crate::wide::triangles::ShearedTriangles) and [`RayGroup::test`], so the
//! hits have the same bits.

use std::arch::x86_64::{
    __m512, __m512i, __mmask16, _CMP_EQ_OQ, _CMP_GE_OQ, _CMP_GT_OQ, _CMP_LE_OQ, _CMP_LT_OQ,
    _mm512_abs_ps, _mm512_add_ps, _mm512_cmp_ps_mask, _mm512_cmpneq_epi32_mask, _mm512_div_ps,
    _mm512_fmadd_ps, _mm512_fmsub_ps, _mm512_fnmadd_ps, _mm512_loadu_epi32, _mm512_loadu_ps,
    _mm512_mask_cmp_ps_mask, _mm512_mask_cmplt_epu32_mask, _mm512_mask_storeu_epi32,
    _mm512_mask_storeu_ps, _mm512_max_ps, _mm512_min_ps, _mm512_mul_ps, _mm512_set1_epi32,
    _mm512_set1_ps, _mm512_setzero_ps, _mm512_sub_ps,
};
use std::sync::LazyLock;

use pt_math::Vec3;
use pt_math::float_error::gamma;

use super::frustum_cull::Met;
use super::group::{GroupColumn, RayGroup};
use super::packet::RayPacket;
use super::ray_slots::SECTION;
use super::{Queues, Stacks};
use crate::ray::CONVERSION;
use crate::wide::{NO_PRIMITIVE, WIDTH, WideNode, lanes};
use crate::{ray, triangle};

/// Number of rays tested at once.
pub(super) const SIXTEEN: usize = 2 * WIDTH;

/// Token that proves that the processor supports AVX-512.
#[derive(Clone, Copy, Debug)]
pub(in crate::wide) struct Avx512(());

#[expect(clippy::unused_self, reason = "it proves that the calls are sound")]
impl Avx512 {
    /// Returns a token if the processor has AVX-512, the build has fused multiply-add, which the
    /// functions here use, and `PATHTRACER_SIMD` does not disable it.
    pub(in crate::wide) fn detect() -> Option<Self> {
        static IS_LEFT_OUT: LazyLock<bool> = LazyLock::new(|| {
            std::env::var_os("PATHTRACER_SIMD").is_some_and(|simd| simd == "avx2")
        });
        let is_there = triangle::IS_FUSED && is_x86_feature_detected!("avx512f");
        (is_there && !*IS_LEFT_OUT).then_some(Self(()))
    }

    /// Tests the rays of a packet, which have one origin, against the triangles that they may hit;
    /// returns true if any passed the filter.
    #[inline(always)]
    pub(super) fn test_fan<const ANY: bool>(
        self,
        group: &mut RayGroup,
        packet: RayPacket<'_>,
        met: &Met,
    ) -> bool {
        // SAFETY: `self` exists only if the processor supports the features of the function.
        #[expect(unsafe_code, reason = "the rest is compiled for other processors too")]
        unsafe {
            group.test_fan_by_sixteen::<ANY>(packet, met)
        }
    }

    /// [`Self::test_fan`] for rays of any origins with the same axis.
    #[inline(always)]
    pub(super) fn test_triangles<const ANY: bool>(
        self,
        group: &mut RayGroup,
        packet: RayPacket<'_>,
        triangles: u32,
    ) -> bool {
        // SAFETY: `self` exists only if the processor supports the features of the function.
        #[expect(unsafe_code, reason = "the rest is compiled for other processors too")]
        unsafe {
            group.test_triangles_by_sixteen::<ANY>(packet, triangles)
        }
    }

    /// Starts those of sixteen rays that are in a set at the root, and descends while many of them
    /// are at the same node. Returns the number of rays with something left to visit.
    #[inline(always)]
    pub(super) fn enter<const ANY: bool>(
        self,
        group: &mut RayGroup,
        stacks: &mut Stacks,
        queues: &mut Queues,
        nodes: &[WideNode],
        first: usize,
        usable: u32,
    ) -> u32 {
        // SAFETY: `self` exists only if the processor supports the features of the function.
        #[expect(unsafe_code, reason = "the rest is compiled for other processors too")]
        unsafe {
            group.enter_by_sixteen::<ANY>(stacks, queues, nodes, first, usable)
        }
    }
}

/// Loads sixteen numbers of a column.
#[inline]
#[target_feature(enable = "avx512f")]
pub(super) fn load(column: &GroupColumn, first: usize) -> __m512 {
    let numbers = &column[first..first + SIXTEEN];
    // SAFETY: sixteen numbers are in the slice, and they need not be aligned.
    #[expect(unsafe_code, reason = "loads of vectors take pointers")]
    unsafe {
        _mm512_loadu_ps(numbers.as_ptr())
    }
}

/// Loads sixteen integers of a column.
#[inline]
#[target_feature(enable = "avx512f")]
pub(super) fn load_bits(column: &[u32], first: usize) -> __m512i {
    let numbers = &column[first..first + SIXTEEN];
    // SAFETY: sixteen numbers are in the slice, and they need not be aligned.
    #[expect(unsafe_code, reason = "loads of vectors take pointers")]
    unsafe {
        _mm512_loadu_epi32(numbers.as_ptr().cast())
    }
}

/// Replaces those of sixteen numbers that are in a set.
#[inline]
#[target_feature(enable = "avx512f")]
fn store(numbers: &mut [f32], set: __mmask16, x: __m512) {
    let numbers = &mut numbers[..SIXTEEN];
    // SAFETY: sixteen numbers are in the slice, and they need not be aligned.
    #[expect(unsafe_code, reason = "stores of vectors take pointers")]
    unsafe {
        _mm512_mask_storeu_ps(numbers.as_mut_ptr(), set, x);
    }
}

/// Replaces those of sixteen numbers of a column that are in a set.
#[inline]
#[target_feature(enable = "avx512f")]
fn store_column(column: &mut GroupColumn, first: usize, set: __mmask16, x: __m512) {
    store(&mut column[first..], set, x);
}

/// Replaces those of sixteen integers of a column that are in a set.
#[inline]
#[target_feature(enable = "avx512f")]
pub(super) fn store_bits(column: &mut [u32], first: usize, set: __mmask16, x: __m512i) {
    let numbers = &mut column[first..first + SIXTEEN];
    // SAFETY: sixteen numbers are in the slice, and they need not be aligned.
    #[expect(unsafe_code, reason = "stores of vectors take pointers")]
    unsafe {
        _mm512_mask_storeu_epi32(numbers.as_mut_ptr().cast(), set, x);
    }
}

#[inline]
#[target_feature(enable = "avx512f")]
fn least([a, b, c]: [__m512; 3]) -> __m512 {
    _mm512_min_ps(_mm512_min_ps(a, b), c)
}

#[inline]
#[target_feature(enable = "avx512f")]
fn greatest([a, b, c]: [__m512; 3]) -> __m512 {
    _mm512_max_ps(_mm512_max_ps(a, b), c)
}

#[inline]
#[target_feature(enable = "avx512f")]
fn same_signs(x: [__m512; 3]) -> __m512 {
    _mm512_mul_ps(least(x), greatest(x))
}

/// Sheared vertices of a triangle, as seen by sixteen rays: vertex, axis.
struct ShearedTriangle([[__m512; 3]; 3]);

impl ShearedTriangle {
    /// Vertices in a lane.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn triangle(&self, lane: usize) -> [[f32; 3]; 3] {
        let mut triangle = [[0.0; 3]; 3];
        for (to, from) in triangle.as_flattened_mut().iter_mut().zip(self.0.as_flattened()) {
            let mut numbers = [0.0; SIXTEEN];
            store(&mut numbers, !0, *from);
            *to = numbers[lane % SIXTEEN];
        }
        triangle
    }

    /// Edge functions, rounded as in the filter.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn edges(&self) -> [__m512; 3] {
        let [[ax, ay, _], [bx, by, _], [cx, cy, _]] = self.0;
        [
            _mm512_sub_ps(_mm512_mul_ps(cx, by), _mm512_mul_ps(cy, bx)),
            _mm512_sub_ps(_mm512_mul_ps(ax, cy), _mm512_mul_ps(ay, cx)),
            _mm512_sub_ps(_mm512_mul_ps(bx, ay), _mm512_mul_ps(by, ax)),
        ]
    }

    /// Edge functions by [`triangle::difference_of_products`].
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn exact_edges(&self) -> [__m512; 3] {
        let [[ax, ay, _], [bx, by, _], [cx, cy, _]] = self.0;
        [difference(cx, by, cy, bx), difference(ax, cy, ay, cx), difference(bx, ay, by, ax)]
    }

    /// Least and greatest depth of the vertices.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn depths(&self) -> (__m512, __m512) {
        let [[.., a], [.., b], [.., c]] = self.0;
        (least([a, b, c]), greatest([a, b, c]))
    }

    /// Mask of the rays that may hit the triangle between their start and their limit.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn may_be_hit(&self, start: __m512, limit: __m512) -> __mmask16 {
        let (nearest, farthest) = self.depths();
        let inside =
            _mm512_cmp_ps_mask::<_CMP_GE_OQ>(same_signs(self.edges()), _mm512_setzero_ps());
        let before = _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(inside, nearest, limit);
        _mm512_mask_cmp_ps_mask::<_CMP_GE_OQ>(before, farthest, start)
    }
}

/// a·b − c·d; see [`triangle::difference_of_products`].
#[inline]
#[target_feature(enable = "avx512f")]
fn difference(a: __m512, b: __m512, c: __m512, d: __m512) -> __m512 {
    let product = _mm512_mul_ps(c, d);
    _mm512_add_ps(_mm512_fmsub_ps(a, b, product), _mm512_fnmadd_ps(c, d, product))
}

/// Results of the test of sixteen rays against a triangle in single precision.
struct PacketTest {
    hit: __mmask16,
    unclear: __mmask16,
    t: __m512,
    barycentric: [__m512; 2],
}

impl ShearedTriangle {
    /// Tests with the operations of [`triangle::judge`].
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn test(&self, inverse_scale: __m512, origin_size: __m512) -> PacketTest {
        let splat = |x: f32| _mm512_set1_ps(x);
        let [a, b, c] = self.0;
        let edges @ [u, v, w] = self.exact_edges();
        let x = greatest([_mm512_abs_ps(a[0]), _mm512_abs_ps(b[0]), _mm512_abs_ps(c[0])]);
        let y = greatest([_mm512_abs_ps(a[1]), _mm512_abs_ps(b[1]), _mm512_abs_ps(c[1])]);
        let (nearest, farthest) = self.depths();
        let minus = |x: __m512| _mm512_sub_ps(splat(-0.0), x);
        let z = _mm512_max_ps(farthest, minus(nearest));
        let det = _mm512_add_ps(_mm512_add_ps(u, v), w);
        let inverse = _mm512_div_ps(splat(1.0), det);
        let total = _mm512_fmadd_ps(w, c[2], _mm512_fmadd_ps(v, b[2], _mm512_mul_ps(u, a[2])));
        let depth = _mm512_mul_ps(total, inverse);
        let t = _mm512_mul_ps(depth, inverse_scale);
        let (least, sides) = (splat(triangle::MIN_DET), same_signs(edges));
        let plain = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(sides, splat(0.0));
        let plain = _mm512_mask_cmp_ps_mask::<_CMP_GE_OQ>(plain, _mm512_abs_ps(det), least);
        let plain =
            _mm512_mask_cmp_ps_mask::<_CMP_LT_OQ>(plain, _mm512_abs_ps(t), splat(f32::INFINITY));

        let across = _mm512_add_ps(x, y);
        let size = _mm512_add_ps(_mm512_add_ps(origin_size, across), _mm512_add_ps(z, z));
        let margin = _mm512_mul_ps(size, splat(gamma(32)));
        let area = _mm512_mul_ps(_mm512_mul_ps(x, y), splat(4.0));
        let spread = _mm512_mul_ps(_mm512_fmadd_ps(z, across, area), z);
        let error = _mm512_mul_ps(_mm512_mul_ps(spread, _mm512_abs_ps(inverse)), splat(gamma(32)));
        let ahead = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(nearest, margin)
            | _mm512_cmp_ps_mask::<_CMP_GT_OQ>(depth, error);
        let hit = _mm512_mask_cmp_ps_mask::<_CMP_GE_OQ>(plain & ahead, _mm512_abs_ps(total), least);
        let behind = _mm512_mask_cmp_ps_mask::<_CMP_LT_OQ>(plain, depth, minus(error));
        let outside = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(sides, splat(0.0));
        let barycentric = [_mm512_mul_ps(v, inverse), _mm512_mul_ps(w, inverse)];
        PacketTest { hit, unclear: !(hit | behind | outside), t, barycentric }
    }
}

impl RayPacket<'_> {
    /// Positions of each sixteen rays of which some are active.
    #[inline]
    fn sixteens(&self) -> impl Iterator<Item = usize> + use<> {
        let (first, looking) = (self.first, self.looking);
        let places = (0..SECTION / SIXTEEN).filter(move |k| looking >> (2 * k) & 3 != 0);
        places.map(move |k| first + k * SIXTEEN)
    }
}

impl RayGroup {
    /// [`RayGroup::test`] of sixteen rays.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn test_sixteen<const ANY: bool>(
        &mut self,
        first: usize,
        set: __mmask16,
        sheared: &ShearedTriangle,
        id: u32,
    ) -> __mmask16 {
        let (inverse_scale, origin_size) =
            (load(&self.inverse_scale, first), load(&self.origin_size, first));
        let PacketTest { hit, unclear, t, barycentric } = sheared.test(inverse_scale, origin_size);
        let (old_t, old) = (load(&self.t, first), load_bits(&self.primitive, first));
        let new = _mm512_set1_epi32(id.cast_signed());
        let any = _mm512_cmpneq_epi32_mask(old, _mm512_set1_epi32(NO_PRIMITIVE.cast_signed()));
        let lower = _mm512_mask_cmplt_epu32_mask(any, new, old);
        let nearer = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(t, old_t)
            | _mm512_mask_cmp_ps_mask::<_CMP_EQ_OQ>(lower, t, old_t);
        let better = hit & set & nearer;
        let better = _mm512_mask_cmp_ps_mask::<_CMP_GT_OQ>(better, t, load(&self.t_min, first));
        store_bits(&mut self.primitive, first, better, new);
        if !ANY {
            let limit = depth_limit(t, load(&self.scale, first));
            let [b1, b2] = barycentric;
            let [column1, column2] = &mut self.barycentric;
            store_column(&mut self.t, first, better, t);
            store_column(column1, first, better, b1);
            store_column(column2, first, better, b2);
            store_column(&mut self.limit, first, better, limit);
        }
        unclear & set
    }

    /// See [`Avx512::test_fan`].
    #[target_feature(enable = "avx512f")]
    fn test_fan_by_sixteen<const ANY: bool>(&mut self, packet: RayPacket<'_>, met: &Met) -> bool {
        let RayPacket { sections, block, .. } = packet;
        let back = _mm512_set1_ps(self.back[packet.first]);
        let mut any = false;
        for lane in lanes(met.triangles) {
            let [a, b, c] = met.to_origin(lane).map(|corner| corner.map(|x| _mm512_set1_ps(x)));
            let id = block.ids[lane % WIDTH];
            for first in packet.sixteens() {
                let slopes = [load(&self.slopes[0], first), load(&self.slopes[1], first)];
                let vertex = |[x, y, z]: [__m512; 3]| {
                    [
                        _mm512_fnmadd_ps(slopes[0], z, x),
                        _mm512_fnmadd_ps(slopes[1], z, y),
                        _mm512_mul_ps(z, back),
                    ]
                };
                let sheared = ShearedTriangle([vertex(a), vertex(b), vertex(c)]);
                let set = sheared.may_be_hit(load(&self.start, first), load(&self.limit, first));
                if set == 0 {
                    continue;
                }
                any = true;
                for k in lanes(u32::from(self.test_sixteen::<ANY>(first, set, &sheared, id))) {
                    let (i, corners) = (first + k, block.triangle(lane));
                    self.confirm(i, &sections.ray(i), sheared.triangle(k), corners, id);
                }
            }
        }
        any
    }

    /// See [`Avx512::test_triangles`].
    #[target_feature(enable = "avx512f")]
    fn test_triangles_by_sixteen<const ANY: bool>(
        &mut self,
        packet: RayPacket<'_>,
        triangles: u32,
    ) -> bool {
        let RayPacket { sections, block, .. } = packet;
        let [kx, ky, kz] = ray::AXES[self.axis[packet.first] as usize % ray::AXES.len()];
        let mut any = false;
        for first in packet.sixteens() {
            let origin = self.origin.each_ref().map(|column| load(column, first));
            let slopes = [load(&self.slopes[0], first), load(&self.slopes[1], first)];
            let back = load(&self.back, first);
            for lane in lanes(triangles) {
                let id = block.ids[lane % WIDTH];
                let corners = block.triangle(lane);
                let vertex = |corner: Vec3| {
                    let to_origin = |k: usize, axis: usize| {
                        _mm512_sub_ps(origin[k], _mm512_set1_ps(corner[axis]))
                    };
                    let z = to_origin(2, kz);
                    [
                        _mm512_fnmadd_ps(slopes[0], z, to_origin(0, kx)),
                        _mm512_fnmadd_ps(slopes[1], z, to_origin(1, ky)),
                        _mm512_mul_ps(z, back),
                    ]
                };
                let [a, b, c] = corners;
                let sheared = ShearedTriangle([vertex(a), vertex(b), vertex(c)]);
                let set = sheared.may_be_hit(load(&self.start, first), load(&self.limit, first));
                if set == 0 {
                    continue;
                }
                any = true;
                for k in lanes(u32::from(self.test_sixteen::<ANY>(first, set, &sheared, id))) {
                    let i = first + k;
                    self.confirm(i, &sections.ray(i), sheared.triangle(k), corners, id);
                }
            }
        }
        any
    }
}

/// [`ray::depth_limit`] of sixteen numbers.
#[inline]
#[target_feature(enable = "avx512f")]
fn depth_limit(t: __m512, scale: __m512) -> __m512 {
    let least = _mm512_set1_ps(ray::MIN);
    let scale = _mm512_mul_ps(_mm512_add_ps(scale, least), _mm512_set1_ps(1.0 + CONVERSION));
    let limit = _mm512_mul_ps(_mm512_add_ps(t, least), scale);
    _mm512_max_ps(limit, _mm512_set1_ps(2.0 * f32::MIN_POSITIVE))
}
