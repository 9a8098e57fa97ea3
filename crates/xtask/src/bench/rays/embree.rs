//! Embree 4, from a shared library that is loaded at run time.
//!
//! The few functions and structures of its C interface that are needed are declared here. The loops
//! over rays are here as well, without indirection: they copy each prepared ray, which the
//! interface requires (it writes into the ray), and call.

#![expect(unsafe_code, reason = "the C interface of a library that is opened at run time")]

use std::ffi::{CString, c_char, c_int, c_uint, c_void};
use std::mem::MaybeUninit;
use std::path::Path;
use std::ptr;
use std::sync::Arc;
use std::sync::atomic::{AtomicIsize, Ordering};
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use libloading::Library;
use pt_bvh::Geometry;
use pt_math::{Ray, Vec3};

/// Handle of a device, scene or geometry.
type EmbreeHandle = *mut c_void;
type Monitor = unsafe extern "C" fn(*mut c_void, isize, bool) -> bool;

/// Constants of the interface.
const TRIANGLES: c_int = 0;
const INDICES: c_int = 0;
const VERTICES: c_int = 1;
const UINT3: c_int = 0x5003;
const FLOAT3: c_int = 0x9003;
const ROBUST: c_int = 4;
const COHERENT: c_int = 1 << 16;
const VERSION: c_int = 0;
/// Invalid number of a geometry or instance, and mask of all bits.
const ALL_ONES: u32 = u32::MAX;

/// One ray in Embree's layout.
#[repr(C, align(16))]
#[derive(Clone, Copy)]
pub(super) struct Single {
    origin: [f32; 3],
    t_near: f32,
    direction: [f32; 3],
    time: f32,
    /// End of the ray; −∞ after an occlusion query that found a hit.
    t_far: f32,
    mask: u32,
    id: u32,
    flags: u32,
}

/// One ray with room for its hit.
#[repr(C, align(16))]
struct SingleHit {
    ray: Single,
    normal_and_uv: [MaybeUninit<f32>; 5],
    primitive: u32,
    geometry: u32,
    instance: u32,
    /// Further instance numbers, whose count depends on the build of the library.
    room: [MaybeUninit<u32>; 24],
}

/// `N` rays in Embree's layout; `N` is 8 or 16.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
pub(super) struct EmbreePacket<const N: usize> {
    origin: [[f32; N]; 3],
    t_near: [f32; N],
    direction: [[f32; N]; 3],
    time: [f32; N],
    t_far: [f32; N],
    mask: [u32; N],
    id: [u32; N],
    flags: [u32; N],
}

/// `N` rays with room for their hits.
#[repr(C, align(64))]
struct PacketHit<const N: usize> {
    rays: EmbreePacket<N>,
    normal_and_uv: [[MaybeUninit<f32>; N]; 5],
    primitive: [MaybeUninit<u32>; N],
    geometry: [u32; N],
    instance: [u32; N],
    room: [[MaybeUninit<u32>; N]; 8],
}

/// Arguments of a query.
#[repr(C)]
#[derive(Clone, Copy)]
struct Arguments {
    flags: c_int,
    features: c_uint,
    context: *mut c_void,
    filter: *mut c_void,
    callback: *mut c_void,
    min_width: f32,
    room: [f32; 7],
}

impl Arguments {
    fn new(coherent: bool) -> Self {
        Self {
            flags: if coherent { COHERENT } else { 0 },
            features: ALL_ONES,
            context: ptr::null_mut(),
            filter: ptr::null_mut(),
            callback: ptr::null_mut(),
            min_width: 0.0,
            room: [0.0; 7],
        }
    }
}

/// Declares the functions that are used, and loads them from a library.
macro_rules! functions {
    ($($name:ident = $symbol:literal: fn($($argument:ty),*) $(-> $result:ty)?;)*) => {
        struct EmbreeFunctions {
            $($name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
            /// Keeps the functions loaded.
            _library: Library,
        }

        impl EmbreeFunctions {
            /// Loads the library.
            ///
            /// # Errors
            /// If the library cannot be opened, or lacks a function.
            fn load(path: &Path) -> Result<Self> {
                // SAFETY: Embree and its threading library may be initialised at any time and from
                // any thread.
                let library = unsafe { Library::new(path) }
                    .with_context(|| format!("{} cannot be opened", path.display()))?;
                $(
                    // SAFETY: the type is that of Embree 4's public header.
                    let $name = *unsafe { library.get($symbol) }
                        .with_context(|| format!("not found in {}", path.display()))?;
                )*
                Ok(Self { $($name,)* _library: library })
            }
        }
    };
}

functions! {
    new_device = b"rtcNewDevice": fn(*const c_char) -> EmbreeHandle;
    release_device = b"rtcReleaseDevice": fn(EmbreeHandle);
    device_error = b"rtcGetDeviceError": fn(EmbreeHandle) -> c_int;
    device_property = b"rtcGetDeviceProperty": fn(EmbreeHandle, c_int) -> isize;
    monitor = b"rtcSetDeviceMemoryMonitorFunction": fn(EmbreeHandle, Monitor, *mut c_void);
    new_scene = b"rtcNewScene": fn(EmbreeHandle) -> EmbreeHandle;
    release_scene = b"rtcReleaseScene": fn(EmbreeHandle);
    scene_quality = b"rtcSetSceneBuildQuality": fn(EmbreeHandle, c_int);
    scene_flags = b"rtcSetSceneFlags": fn(EmbreeHandle, c_int);
    new_geometry = b"rtcNewGeometry": fn(EmbreeHandle, c_int) -> EmbreeHandle;
    release_geometry = b"rtcReleaseGeometry": fn(EmbreeHandle);
    geometry_quality = b"rtcSetGeometryBuildQuality": fn(EmbreeHandle, c_int);
    share_buffer = b"rtcSetSharedGeometryBuffer":
        fn(EmbreeHandle, c_int, c_uint, c_int, *const c_void, usize, usize, usize);
    commit_geometry = b"rtcCommitGeometry": fn(EmbreeHandle);
    attach_geometry = b"rtcAttachGeometry": fn(EmbreeHandle, EmbreeHandle) -> c_uint;
    commit_scene = b"rtcCommitScene": fn(EmbreeHandle);
    intersect1 = b"rtcIntersect1": fn(EmbreeHandle, *mut SingleHit, *mut Arguments);
    occluded1 = b"rtcOccluded1": fn(EmbreeHandle, *mut Single, *mut Arguments);
    intersect8 = b"rtcIntersect8": fn(*const c_int, EmbreeHandle, *mut PacketHit<8>, *mut Arguments);
    occluded8 = b"rtcOccluded8": fn(*const c_int, EmbreeHandle, *mut EmbreePacket<8>, *mut Arguments);
    intersect16 = b"rtcIntersect16": fn(*const c_int, EmbreeHandle, *mut PacketHit<16>, *mut Arguments);
    occluded16 = b"rtcOccluded16": fn(*const c_int, EmbreeHandle, *mut EmbreePacket<16>, *mut Arguments);
}

type IntersectPacket<const N: usize> =
    unsafe extern "C" fn(*const c_int, EmbreeHandle, *mut PacketHit<N>, *mut Arguments);
type OccludedPacket<const N: usize> =
    unsafe extern "C" fn(*const c_int, EmbreeHandle, *mut EmbreePacket<N>, *mut Arguments);

/// Embree library.
#[derive(Clone)]
pub(super) struct Embree {
    functions: Arc<EmbreeFunctions>,
}

/// Quality of a build.
#[derive(Clone, Copy)]
pub(super) enum EmbreeQuality {
    /// Embree's default.
    Medium = 1,
    /// High quality, with spatial splits.
    High = 2,
}

/// Result of a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct EmbreeHit {
    /// Ray parameter.
    pub(super) t: f32,
    /// Number of the triangle.
    pub(super) primitive: u32,
}

/// Mesh with its tree.
pub(super) struct EmbreeScene {
    functions: Arc<EmbreeFunctions>,
    device: EmbreeHandle,
    handle: EmbreeHandle,
    /// Memory used by the device, in bytes; updated by the library until the device is released.
    bytes: Box<AtomicIsize>,
    /// The library reads these, and up to 16 bytes from the start of the last element.
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// Time of the build in seconds.
    pub(super) seconds: f64,
}

impl Embree {
    /// Opens the library.
    ///
    /// # Errors
    /// If the library cannot be opened, or is not Embree 4.
    pub(super) fn open(path: &Path) -> Result<Self> {
        Ok(Self { functions: Arc::new(EmbreeFunctions::load(path)?) })
    }

    /// Builds the tree of the triangles of `geometry` with up to `threads` threads. The number of
    /// threads is the maximum over all living scenes, so measure builds one after the other.
    ///
    /// # Errors
    /// If Embree reports one.
    pub(super) fn build(
        &self,
        geometry: &Geometry<'_>,
        quality: EmbreeQuality,
        robust: bool,
        threads: usize,
    ) -> Result<EmbreeScene> {
        let mut scene = self.empty_scene(geometry, threads)?;
        let f = &*self.functions;
        let start = Instant::now();
        // SAFETY: the handles are alive; the buffers have the given formats, strides and counts,
        // and live in the scene, with an element to spare, until it is released.
        unsafe {
            (f.scene_quality)(scene.handle, quality as c_int);
            (f.scene_flags)(scene.handle, if robust { ROBUST } else { 0 });
            let mesh = (f.new_geometry)(scene.device, TRIANGLES);
            (f.geometry_quality)(mesh, quality as c_int);
            let positions = scene.positions.as_ptr().cast();
            let count = geometry.positions.len();
            (f.share_buffer)(mesh, VERTICES, 0, FLOAT3, positions, 0, 12, count);
            let triangles = scene.triangles.as_ptr().cast();
            let count = geometry.triangles.len();
            (f.share_buffer)(mesh, INDICES, 0, UINT3, triangles, 0, 12, count);
            (f.commit_geometry)(mesh);
            (f.attach_geometry)(scene.handle, mesh);
            (f.release_geometry)(mesh);
            (f.commit_scene)(scene.handle);
        }
        scene.seconds = start.elapsed().as_secs_f64();
        // SAFETY: the device is alive.
        let error = unsafe { (f.device_error)(scene.device) };
        ensure!(error == 0, "Embree reports error {error}");
        Ok(scene)
    }

    fn empty_scene(&self, geometry: &Geometry<'_>, threads: usize) -> Result<EmbreeScene> {
        let f = &*self.functions;
        // At the level simd256, trees are eight wide.
        let threads = format!("threads={threads},start_threads=1,set_affinity=0");
        let configuration = format!("{threads},frequency_level=simd256");
        let configuration = CString::new(configuration)?;
        // SAFETY: the string ends with a 0.
        let device = unsafe { (f.new_device)(configuration.as_ptr()) };
        ensure!(!device.is_null(), "Embree cannot make a device");
        let bytes = Box::new(AtomicIsize::new(0));
        let counter = ptr::from_ref(&*bytes).cast_mut().cast();
        // SAFETY: the device is alive, and released before the counter is.
        let handle = unsafe {
            (f.monitor)(device, count_bytes, counter);
            (f.new_scene)(device)
        };
        let positions = geometry.positions.iter().copied().chain([Vec3::ZERO]).collect();
        let triangles = geometry.triangles.iter().copied().chain([[0; 3]]).collect();
        let functions = Arc::clone(&self.functions);
        Ok(EmbreeScene { functions, device, handle, bytes, positions, triangles, seconds: 0.0 })
    }
}

/// Adds the memory that Embree allocates (or frees, if negative) to the counter at `counter`.
unsafe extern "C" fn count_bytes(counter: *mut c_void, bytes: isize, _after: bool) -> bool {
    // SAFETY: `empty_scene` passes a counter that outlives the device.
    let counter = unsafe { &*counter.cast::<AtomicIsize>() };
    counter.fetch_add(bytes, Ordering::Relaxed);
    true
}

impl Drop for EmbreeScene {
    fn drop(&mut self) {
        // SAFETY: both are alive, and not used any more.
        unsafe {
            (self.functions.release_scene)(self.handle);
            (self.functions.release_device)(self.device);
        }
    }
}

impl EmbreeScene {
    /// Memory used by the library for the mesh and its tree, without the shared buffers.
    pub(super) fn bytes(&self) -> isize {
        self.bytes.load(Ordering::Relaxed)
    }

    /// Version of the library, as in 4.4.0.
    pub(super) fn version(&self) -> String {
        // SAFETY: the device is alive.
        let v = unsafe { (self.functions.device_property)(self.device, VERSION) };
        format!("{}.{}.{}", v / 10000, v / 100 % 100, v % 100)
    }

    /// Passes the nearest hit of each ray to `take`, in order.
    #[inline]
    pub(super) fn intersect(&self, rays: &[Single], mut take: impl FnMut(Option<EmbreeHit>)) {
        let (call, scene, arguments) =
            (self.functions.intersect1, self.handle, Arguments::new(false));
        for ray in rays {
            let mut arguments = arguments;
            let mut query = SingleHit {
                ray: *ray,
                normal_and_uv: [MaybeUninit::uninit(); 5],
                primitive: ALL_ONES,
                geometry: ALL_ONES,
                instance: ALL_ONES,
                room: [MaybeUninit::uninit(); 24],
            };
            // SAFETY: the scene is committed; the structures are Embree's, and live for the call.
            unsafe { call(scene, &raw mut query, &raw mut arguments) };
            let found = EmbreeHit { t: query.ray.t_far, primitive: query.primitive };
            take((query.geometry != ALL_ONES).then_some(found));
        }
    }

    /// Passes to `take`, for each ray in order, true if it hits anything.
    #[inline]
    pub(super) fn occluded(&self, rays: &[Single], mut take: impl FnMut(bool)) {
        let (call, scene, arguments) =
            (self.functions.occluded1, self.handle, Arguments::new(false));
        for ray in rays {
            let (mut arguments, mut ray) = (arguments, *ray);
            // SAFETY: as in `intersect`.
            unsafe { call(scene, &raw mut ray, &raw mut arguments) };
            take(ray.t_far < 0.0);
        }
    }

    /// Returns the number of rays that hit something: nearest hits, 8 at a time.
    pub(super) fn intersect8(&self, packets: &[EmbreePacket<8>], coherent: bool) -> usize {
        self.intersect_packets(self.functions.intersect8, packets, coherent)
    }

    /// Returns the number of rays that hit something: nearest hits, 16 at a time.
    pub(super) fn intersect16(&self, packets: &[EmbreePacket<16>], coherent: bool) -> usize {
        self.intersect_packets(self.functions.intersect16, packets, coherent)
    }

    /// Returns the number of rays that hit anything, 8 at a time.
    pub(super) fn occluded8(&self, packets: &[EmbreePacket<8>], coherent: bool) -> usize {
        self.occluded_packets(self.functions.occluded8, packets, coherent)
    }

    /// Returns the number of rays that hit anything, 16 at a time.
    pub(super) fn occluded16(&self, packets: &[EmbreePacket<16>], coherent: bool) -> usize {
        self.occluded_packets(self.functions.occluded16, packets, coherent)
    }

    #[inline]
    fn intersect_packets<const N: usize>(
        &self,
        call: IntersectPacket<N>,
        packets: &[EmbreePacket<N>],
        coherent: bool,
    ) -> usize {
        let (valid, scene, arguments) = (Valid([-1; 16]), self.handle, Arguments::new(coherent));
        let mut hits = 0;
        for rays in packets {
            let mut arguments = arguments;
            let mut query = PacketHit {
                rays: *rays,
                normal_and_uv: [[MaybeUninit::uninit(); N]; 5],
                primitive: [MaybeUninit::uninit(); N],
                geometry: [ALL_ONES; N],
                instance: [ALL_ONES; N],
                room: [[MaybeUninit::uninit(); N]; 8],
            };
            // SAFETY: as in `intersect`; `valid` has at least `N` entries, aligned to 64 bytes.
            unsafe { call(valid.0.as_ptr(), scene, &raw mut query, &raw mut arguments) };
            hits += query.geometry.iter().filter(|&&g| g != ALL_ONES).count();
        }
        hits
    }

    #[inline]
    fn occluded_packets<const N: usize>(
        &self,
        call: OccludedPacket<N>,
        packets: &[EmbreePacket<N>],
        coherent: bool,
    ) -> usize {
        let (valid, scene, arguments) = (Valid([-1; 16]), self.handle, Arguments::new(coherent));
        let mut hits = 0;
        for rays in packets {
            let (mut arguments, mut rays) = (arguments, *rays);
            // SAFETY: as in `intersect_packets`.
            unsafe { call(valid.0.as_ptr(), scene, &raw mut rays, &raw mut arguments) };
            hits += rays.t_far.iter().filter(|&&t| t < 0.0).count();
        }
        hits
    }
}

/// Active rays of a packet: −1 for each.
#[repr(align(64))]
struct Valid([c_int; 16]);

/// Converts a ray to Embree's layout.
pub(super) fn single(ray: &Ray) -> Single {
    Single {
        origin: ray.origin.to_array(),
        t_near: ray.t_min,
        direction: ray.direction.to_array(),
        time: 0.0,
        t_far: ray.t_max,
        mask: ALL_ONES,
        id: 0,
        flags: 0,
    }
}

/// Packs each `N` consecutive rays; an incomplete packet is omitted.
pub(super) fn packets<const N: usize>(rays: &[Ray]) -> Vec<EmbreePacket<N>> {
    let (whole, _) = rays.as_chunks::<N>();
    let transposed = |v: &[Vec3; N]| [0, 1, 2].map(|axis| v.map(|v| v[axis]));
    let packet = |rays: &[Ray; N]| EmbreePacket {
        origin: transposed(&rays.map(|r| r.origin)),
        t_near: rays.map(|r| r.t_min),
        direction: transposed(&rays.map(|r| r.direction)),
        time: [0.0; N],
        t_far: rays.map(|r| r.t_max),
        mask: [ALL_ONES; N],
        id: [0; N],
        flags: [0; N],
    };
    whole.iter().map(packet).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sizes and offsets of Embree's own structures.
    #[test]
    fn structures_have_the_layout_of_the_interface() {
        assert_eq!((size_of::<Single>(), align_of::<Single>()), (48, 16));
        assert_eq!(std::mem::offset_of!(SingleHit, primitive), 68);
        assert_eq!(std::mem::offset_of!(SingleHit, geometry), 72);
        assert_eq!((size_of::<EmbreePacket<8>>(), size_of::<EmbreePacket<16>>()), (384, 768));
        assert_eq!(std::mem::offset_of!(PacketHit<16>, geometry), 768 + 6 * 64);
    }

    #[test]
    fn packets_hold_the_rays_in_order() {
        let ray = |i: usize| Ray::to(Vec3::splat(i as f32), Vec3::X, 10.0 + i as f32);
        let rays: Vec<_> = (0..20).map(ray).collect();
        let packets = packets::<8>(&rays);
        assert_eq!(packets.len(), 2);
        assert_eq!(packets[1].origin[2][3], 11.0);
        assert_eq!(packets[1].direction[0][3], 1.0);
        assert_eq!(packets[1].t_far[3], 21.0);
    }
}
