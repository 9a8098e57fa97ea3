//! A scene with its origin and its compilation, for other threads.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use pathtracer::queries::SceneQueries;
use pathtracer::{CompiledScene, Hierarchies};
use pt_cli::{PreparedRender, RenderRequest, SceneOrigin};

/// Place of a compilation.
type Cell = Arc<Mutex<Option<CompiledScene>>>;

/// A scene, its origin and its last compilation. Clones share all of it.
#[derive(Clone)]
pub(crate) struct SceneSource {
    pub(crate) scene: Arc<pathtracer::Scene>,
    pub(crate) origin: Arc<SceneOrigin>,
    /// Last compilation of the scene, or of the one from which it was edited.
    compiled: Cell,
    /// Last compilation of all scenes with these objects that were edited from each other.
    of_family: Cell,
    /// Hierarchies of a compilation elsewhere.
    hierarchies: Hierarchies,
}

impl SceneSource {
    pub(crate) fn new(scene: pathtracer::Scene, origin: SceneOrigin) -> Self {
        let (compiled, of_family, hierarchies) = Default::default();
        let (scene, origin) = (Arc::new(scene), Arc::new(origin));
        Self { scene, origin, compiled, of_family, hierarchies }
    }

    /// Hierarchies of the last compilation, if there was one.
    pub(crate) fn hierarchies(&self) -> Option<Hierarchies> {
        self.compiled().map(|compiled| compiled.hierarchies())
    }

    /// The same scene, which is compiled with these hierarchies.
    pub(crate) fn with_hierarchies(self, hierarchies: Hierarchies) -> Self {
        Self { hierarchies, ..self }
    }

    /// Another version of the scene, which takes over what is compiled.
    pub(crate) fn edited(&self, scene: pathtracer::Scene, origin: SceneOrigin) -> Self {
        let has_objects = scene.objects.is_one_with(&self.scene.objects);
        let of_family = if has_objects { Arc::clone(&self.of_family) } else { Cell::default() };
        let compiled = Arc::new(Mutex::new(self.compiled()));
        let hierarchies = self.hierarchies.clone();
        Self { compiled, of_family, hierarchies, ..Self::new(scene, origin) }
    }

    /// Returns true if a compilation takes over parts of an earlier one.
    pub(crate) fn is_compiled(&self) -> bool {
        self.compiled().is_some()
    }

    /// Compiles the scene for a request, and keeps the compilation.
    ///
    /// # Errors
    /// As [`RenderRequest::prepare`].
    pub(crate) fn prepare(&self, request: RenderRequest) -> Result<PreparedRender, String> {
        let earlier = self.taken();
        let request = request.with_hierarchies(self.hierarchies.clone());
        let prepared = request.prepare(&self.scene, &self.origin, earlier)?;
        let compiled = prepared.session.compiled();
        *locked(&self.of_family) = Some(compiled.clone());
        *locked(&self.compiled) = Some(compiled);
        Ok(prepared)
    }

    /// Compiles the surfaces for ray queries.
    ///
    /// # Errors
    /// If the scene is inconsistent.
    pub(crate) fn queries(&self) -> Result<SceneQueries, pathtracer::CompileError> {
        match self.compiled() {
            Some(earlier) => SceneQueries::edited(earlier, &self.scene),
            None => SceneQueries::new(&self.scene),
        }
    }

    fn compiled(&self) -> Option<CompiledScene> {
        let own = locked(&self.compiled).clone();
        own.or_else(|| locked(&self.of_family).clone())
    }

    /// The last compilation, which is given up if other objects were compiled, so that these may be
    /// moved in place.
    fn taken(&self) -> Option<CompiledScene> {
        let mut compiled = locked(&self.compiled);
        let is_other = compiled.as_ref().is_some_and(|own| !own.has_objects_of(&self.scene));
        let own = if is_other { compiled.take() } else { compiled.clone() };
        drop(compiled);
        own.or_else(|| locked(&self.of_family).clone())
    }
}

fn locked(cell: &Cell) -> MutexGuard<'_, Option<CompiledScene>> {
    cell.lock().unwrap_or_else(PoisonError::into_inner)
}
