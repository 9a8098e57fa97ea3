import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, SupportsFloat, SupportsIndex, TypedDict, final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Self, Unpack

from . import build

_Path = str | os.PathLike[str]
_Integer = SupportsIndex | str
_Real = SupportsFloat | str
_Integers = Sequence[SupportsIndex] | NDArray[np.integer[Any]]
_Tonemap = Literal["linear", "filmic", "agx", "aces", "pbr-neutral"]

__all__ = [
    "Bsdf",
    "Bvh",
    "Finding",
    "Hits",
    "Image",
    "Images",
    "Interrupted",
    "Light",
    "PartialRender",
    "PhaseFunction",
    "Progress",
    "Sampler",
    "Scene",
    "SceneError",
    "__version__",
    "camera_of",
    "cluster_commands",
    "default_scene",
    "denoise",
    "develop",
    "explain",
    "hierarchies",
    "join",
    "lights",
    "load",
    "loads",
    "merge",
    "merge_parts",
    "program",
    "reading_options",
    "render",
    "render_iter",
    "render_until",
    "rerender",
    "resume",
    "settings",
    "view_numbers",
    "with_camera",
    "with_hierarchies",
]

__version__: str

class _ReadingOptions(TypedDict, total=False):
    allow_outside: bool | None
    allow_folders: Sequence[_Path] | None
    limits: Mapping[str, int] | None
    point_radius: float | None
    strict: bool | None

class _LoadOptions(_ReadingOptions, total=False):
    variables: Mapping[str, object] | None
    time: float | None
    camera: str | int | None

_Values = Mapping[str, Any]
_Transform = build.Step | Sequence[build.Step] | ArrayLike
_Camera = build.PerspectiveCamera | build.OrthographicCamera | build.PanoramaCamera

class _SceneParts(_ReadingOptions, total=False):
    camera: build.Camera | None
    cameras: Sequence[build.Camera] | None
    used_camera: int | None
    objects: Sequence[build.Object] | None
    lights: Sequence[build.Light] | None
    settings: build.Settings | _Values | None
    materials: Mapping[str, build.Material] | None
    media: Mapping[str, build.Medium] | None
    meshes: Mapping[str, build.Mesh | _Values] | None
    points: Mapping[str, build.Points | _Values] | None
    images: Mapping[str, build.Image | _Values] | None
    textures: Mapping[str, build.Texture] | None
    grids: Mapping[str, build.Grid | _Values] | None
    profiles: Mapping[str, build.IesProfile | _Values] | None
    measurements: Mapping[str, build.Measurements | _Values] | None
    motions: Mapping[str, Sequence[build.MotionKey | _Values]] | None
    name: str | None
    metres_per_unit: float | None

class _Edits(TypedDict, total=False):
    camera: build.Camera | None
    used_camera: str | int | None
    materials: Mapping[str, build.Material] | None
    transforms: Mapping[Any, _Transform] | None
    lights: Sequence[build.Light] | Mapping[Any, build.Light] | None
    settings: build.Settings | _Values | None
    textures: Mapping[str, build.Texture] | None
    images: Mapping[str, build.Image | _Values] | None
    meshes: Mapping[str, build.Mesh | _Values] | None
    points: Mapping[str, build.Points | _Values] | None
    grids: Mapping[str, build.Grid | _Values] | None
    profiles: Mapping[str, build.IesProfile | _Values] | None
    measurements: Mapping[str, build.Measurements | _Values] | None
    motions: Mapping[str, Sequence[build.MotionKey | _Values]] | None
    allow_outside: bool | None
    allow_folders: Sequence[_Path] | None
    limits: Mapping[str, int] | None
    strict: bool | None

class _Settings(TypedDict, total=False):
    resolution: _Integers | None
    crop: _Integers | None
    alpha: bool | Literal["on", "off"] | None
    hide_background: bool | None
    hide_emitters: bool | None
    spp: _Integer | None
    light_samples: _Integer | None
    max_depth: _Integer | None
    exact_depth: bool | None
    direct: Literal["mis", "light", "hemisphere", "cosine"] | None
    adaptive: tuple[_Integer, _Real] | Sequence[_Real] | None
    target_error: _Real | None
    target_noise: _Real | None
    uniform_sampling: bool | None
    confidence: _Real | None
    max_spp: _Integer | None
    time_limit: _Real | None
    clamp: _Real | None
    clamp_indirect: _Real | None
    path_reuse: _Integer | None
    path_splitting: _Integer | None
    sampler: Literal["sobol", "zsobol", "stratified", "independent"] | None
    filter: (
        Literal["box", "tent", "gaussian", "mitchell", "blackman-harris", "catmull-rom", "lanczos"]
        | None
    )
    seed: _Integer | None
    integrator: str | None
    ao_distance: _Real | None
    light_component: Literal["emission", "direct", "indirect", "global"] | None
    aov: str | Sequence[str] | None
    light_groups: str | Sequence[str] | Mapping[str, str | Sequence[str] | None] | None
    environment: _Path | None
    environment_layout: Literal["latlong", "angular", "mirror-ball", "octahedral"] | None
    camera_file: _Path | None
    lens_radius: _Real | None
    aperture_blades: _Integer | None
    aperture_rotation: _Real | None
    panorama: bool | None
    smooth_shadows: bool | None
    focal_distance: _Real | None
    threads: _Integer | None
    bvh: Literal["sah", "mean", "none"] | None
    bvh_quality: Literal["fast", "balanced", "high"] | None
    max_leaf_size: _Integer | None
    tile_size: _Integer | None

class _Development(TypedDict, total=False):
    exposure: SupportsFloat | Literal["auto"] | None
    tonemap: _Tonemap | None

class _PngOptions(_Development, total=False):
    png_bits: Literal[8, 16] | None

class _SaveOptions(_PngOptions, total=False):
    exr_type: Literal["float", "half"] | None
    exr_compression: (
        Literal["none", "rle", "zips", "zip", "piz", "pxr24", "b44", "b44a"] | None
    )
    metadata: Literal["full", "stable", "none"] | None

class _DevelopOptions(_PngOptions, total=False):
    layer: str | None
    crop: _Integers | None
    resize: _Integers | None
    exr_type: Literal["float", "half"] | None
    exr_compression: (
        Literal["none", "rle", "zips", "zip", "piz", "pxr24", "b44", "b44a"] | None
    )
    alpha: bool | Literal["on", "off"] | None

class _DenoiseOptions(_PngOptions, total=False):
    threads: _Integer | None

class _JoinOptions(_PngOptions, total=False):
    allow_gaps: bool | None

_Report = Callable[[Progress], object] | bool | None

_View = build.Camera | _Values | str | SupportsIndex | ArrayLike

class SceneError(ValueError):
    errors: list[Finding]

class Interrupted(KeyboardInterrupt):
    partial: Image | None

@final
class Finding:
    @property
    def severity(self) -> str: ...
    @property
    def message(self) -> str: ...
    @property
    def file(self) -> Path | None: ...
    @property
    def line(self) -> int | None: ...
    @property
    def column(self) -> int | None: ...
    @property
    def element(self) -> str | None: ...

@final
class Scene:
    def __new__(cls, *, folder: _Path = ..., **parts: Unpack[_SceneParts]) -> Self: ...
    @staticmethod
    def from_dict(
        scene: dict[str, Any], folder: _Path = ..., **options: Unpack[_LoadOptions]
    ) -> Scene: ...
    def to_dict(self) -> dict[str, Any]: ...
    def replace(self, *, folder: _Path = ..., **changes: Unpack[_Edits]) -> Scene: ...
    @property
    def camera(self) -> _Camera | None: ...
    @property
    def cameras(self) -> list[_Camera]: ...
    @property
    def materials(self) -> list[str]: ...
    def material(self, name: str) -> Any: ...
    @property
    def lights(self) -> list[str]: ...
    def light(self, light: str | int) -> Any: ...
    @property
    def objects(self) -> list[str]: ...
    @property
    def transforms(self) -> dict[str | int, NDArray[np.float64]]: ...
    @property
    def compiled(self) -> bool: ...
    @property
    def name(self) -> str: ...
    @property
    def missing(self) -> list[Finding]: ...
    @property
    def notes(self) -> list[Finding]: ...
    def check(self) -> list[Finding]: ...
    def save(self, path: _Path, *, overwrite: bool = False) -> list[str]: ...
    def intersect(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        tmax: ArrayLike | None = None,
        *,
        tmin: ArrayLike | None = None,
    ) -> Hits: ...
    def occluded(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        tmax: ArrayLike | None = None,
        *,
        tmin: ArrayLike | None = None,
    ) -> NDArray[np.bool_]: ...

_Floats = NDArray[np.float32]

@final
class Bsdf:
    def __new__(
        cls,
        material: build.Material,
        *,
        uv: tuple[float, float] = ...,
        choice: float = 0.5,
        **parts: Unpack[_SceneParts],
    ) -> Self: ...
    def eval(self, wo: ArrayLike, wi: ArrayLike) -> _Floats: ...
    def pdf(self, wo: ArrayLike, wi: ArrayLike) -> _Floats: ...
    def sample(self, wo: ArrayLike, u: ArrayLike) -> tuple[_Floats, _Floats, _Floats]: ...

@final
class Light:
    @property
    def kind(self) -> str: ...
    def sample(
        self, position: ArrayLike, u: ArrayLike, normal: ArrayLike | None = None
    ) -> tuple[_Floats, _Floats, _Floats, _Floats]: ...
    def pdf(
        self, position: ArrayLike, wi: ArrayLike, normal: ArrayLike | None = None
    ) -> _Floats: ...

@final
class PhaseFunction:
    def __new__(cls, phase: build.Phase, **parts: Unpack[_SceneParts]) -> Self: ...
    def eval(self, wo: ArrayLike, wi: ArrayLike) -> _Floats: ...
    def pdf(self, wo: ArrayLike, wi: ArrayLike) -> _Floats: ...
    def sample(self, wo: ArrayLike, u: ArrayLike) -> tuple[_Floats, _Floats]: ...

@final
class Sampler:
    def __new__(
        cls,
        kind: Literal["sobol", "zsobol", "stratified", "independent"] = "sobol",
        *,
        seed: SupportsIndex = 0,
    ) -> Self: ...
    def points(
        self,
        n: SupportsIndex,
        dims: SupportsIndex,
        *,
        pixel: tuple[SupportsIndex, SupportsIndex] = ...,
    ) -> _Floats: ...

@final
class Hits:
    @property
    def t(self) -> NDArray[np.float32]: ...
    @property
    def shape(self) -> NDArray[np.int32]: ...
    @property
    def primitive(self) -> NDArray[np.int32]: ...
    @property
    def uv(self) -> NDArray[np.float32]: ...
    @property
    def position(self) -> NDArray[np.float32]: ...
    @property
    def normal(self) -> NDArray[np.float32]: ...

@final
class Bvh:
    def __new__(
        cls,
        vertices: ArrayLike,
        faces: ArrayLike,
        *,
        quality: Literal["fast", "balanced", "high"] = "balanced",
    ) -> Self: ...
    @property
    def bounds(self) -> tuple[list[float], list[float]] | None: ...
    @property
    def skipped(self) -> int: ...
    @property
    def nbytes(self) -> int: ...
    def __len__(self) -> int: ...
    def intersect(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        tmax: ArrayLike | None = None,
        *,
        tmin: ArrayLike | None = None,
    ) -> Hits: ...
    def occluded(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        tmax: ArrayLike | None = None,
        *,
        tmin: ArrayLike | None = None,
    ) -> NDArray[np.bool_]: ...

@final
class Progress:
    @property
    def samples(self) -> int: ...
    @property
    def total(self) -> int: ...
    @property
    def rays(self) -> int: ...
    @property
    def seconds(self) -> float: ...
    @property
    def error(self) -> float | None: ...
    @property
    def fraction(self) -> float: ...

@final
class Image:
    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def notes(self) -> list[str]: ...
    @property
    def complete(self) -> bool: ...
    @property
    def samples(self) -> int: ...
    @property
    def rays(self) -> int: ...
    @property
    def seconds(self) -> float: ...
    def __getitem__(self, key: str, /) -> NDArray[Any]: ...
    def __contains__(self, key: object, /) -> bool: ...
    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[str]: ...
    def keys(self) -> list[str]: ...
    @property
    def receipt(self) -> dict[str, Any]: ...
    @property
    def camera(self) -> dict[str, Any] | None: ...
    def denoise(self, *, threads: int | None = None) -> Image: ...
    def to_srgb(self, **options: Unpack[_Development]) -> NDArray[np.uint8]: ...
    def save(self, path: _Path, **options: Unpack[_SaveOptions]) -> None: ...
    def _repr_png_(self) -> bytes: ...

@final
class Images:
    def __iter__(self) -> Images: ...
    def __next__(self) -> Image: ...

_Rectangle = tuple[int, int, int, int]
_Taken = tuple[bytes, int, int, float]

@final
class PartialRender:
    def __new__(
        cls,
        scene: Scene,
        *,
        width: _Integer | None = None,
        height: _Integer | None = None,
        aovs: Sequence[str] | None = None,
        **settings: Unpack[_Settings],
    ) -> Self: ...
    @property
    def identity(self) -> str: ...
    @property
    def is_continued(self) -> bool: ...
    @property
    def has_target(self) -> bool: ...
    @property
    def region(self) -> _Rectangle: ...
    @property
    def time_limit(self) -> float | None: ...
    @property
    def samples(self) -> int: ...
    @property
    def seconds(self) -> float: ...
    @property
    def rays(self) -> int: ...
    @property
    def film_hash(self) -> str: ...
    def parts(self, size: int) -> list[tuple[_Rectangle, int, int, int, int]]: ...
    def render_part(self, region: _Rectangle, first: int, end: int, threads: int) -> _Taken: ...
    def continue_part(self, film: bytes, end: int, threads: int) -> _Taken: ...
    def add(self, film: bytes) -> None: ...
    def part(self, region: _Rectangle) -> bytes: ...
    def put_back(self, film: bytes) -> None: ...
    def plan_round(self) -> bool: ...
    def keep(self, path: _Path) -> None: ...
    def save(self, seconds: float, rays: int, finished: bool) -> None: ...
    def progress(self, samples: int, total: int, rays: int, seconds: float) -> Progress: ...
    def image(self, threads: int) -> Image: ...

def camera_of(scene: Scene, key: str | SupportsIndex) -> build.Camera: ...
def cluster_commands(arguments: Sequence[str]) -> list[dict[str, Any]]: ...
def default_scene() -> Scene: ...
def denoise(
    images: _Path | Iterable[_Path],
    output: _Path | None = None,
    **options: Unpack[_DenoiseOptions],
) -> list[Path]: ...
def develop(
    images: _Path | Iterable[_Path],
    output: _Path | None = None,
    **options: Unpack[_DevelopOptions],
) -> list[Path]: ...
def explain(
    scene: Scene | _Path,
    x: SupportsIndex,
    y: SupportsIndex,
    *,
    sample: SupportsIndex | None = None,
    top: SupportsIndex | None = None,
    width: _Integer | None = None,
    height: _Integer | None = None,
    **settings: Unpack[_Settings],
) -> list[dict[str, Any]]: ...
def join(
    parts: _Path | Iterable[_Path], output: _Path, **options: Unpack[_JoinOptions]
) -> list[Path]: ...
def lights(scene: Scene) -> list[Light]: ...
def load(path: _Path, **options: Unpack[_LoadOptions]) -> Scene: ...
def loads(
    text: str | bytes, format: str, folder: _Path = ..., **options: Unpack[_LoadOptions]
) -> Scene: ...
def merge(paths: Sequence[_Path], output: _Path) -> Image: ...
def merge_parts(films: Sequence[bytes]) -> bytes: ...
def program(arguments: Sequence[str | os.PathLike[str]]) -> int: ...
def reading_options(scene: Scene) -> dict[str, Any]: ...
def with_camera(scene: Scene, camera: str) -> Scene | None: ...
def hierarchies(scene: Scene) -> bytes: ...
def with_hierarchies(scene: Scene, known: bytes) -> Scene: ...
def render(
    scene: Scene,
    *,
    width: _Integer | None = None,
    height: _Integer | None = None,
    aovs: Sequence[str] | None = None,
    progress: _Report = None,
    **settings: Unpack[_Settings],
) -> Image: ...
def render_until(
    scene: Scene,
    cancelled: Callable[[], bool],
    *,
    width: _Integer | None = None,
    height: _Integer | None = None,
    aovs: Sequence[str] | None = None,
    progress: _Report = None,
    **settings: Unpack[_Settings],
) -> Image: ...
def render_iter(
    scene: Scene,
    *,
    width: _Integer | None = None,
    height: _Integer | None = None,
    aovs: Sequence[str] | None = None,
    interval: float = 1.0,
    **settings: Unpack[_Settings],
) -> Images: ...
def rerender(
    path: _Path,
    *,
    output: _Path | None = None,
    force: bool | None = None,
    threads: _Integer | None = None,
    allow_outside: bool | None = None,
    allow_folders: Sequence[_Path] | None = None,
    progress: _Report = None,
) -> Image: ...
def resume(
    path: _Path,
    *,
    spp: _Integer | None = None,
    threads: _Integer | None = None,
    time_limit: _Real | None = None,
    checkpoint_every: _Real | None = None,
    allow_outside: bool | None = None,
    allow_folders: Sequence[_Path] | None = None,
    progress: _Report = None,
) -> Image: ...
def settings() -> dict[str, str]: ...
def view_numbers(path: _Path) -> tuple[Path, list[int]]: ...
