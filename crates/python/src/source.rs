//! A scene with its origin and its compilation, for other threads.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use pathtracer::CompiledScene;
use pathtracer::queries::SceneQueries;
use pt_cli::{PreparedRender, RenderRequest, SceneOrigin};

/// A scene, its origin and its last compilation. Clones share all of it.
#[derive(Clone)]
pub(crate) struct SceneSource {
    pub(crate) scene: Arc<pathtracer::Scene>,
    pub(crate) origin: Arc<SceneOrigin>,
    /// Last compilation of the scene, or of the one from which it was edited.
    compiled: Arc<Mutex<Option<CompiledScene>>>,
}

impl SceneSource {
    pub(crate) fn new(scene: pathtracer::Scene, origin: SceneOrigin) -> Self {
        Self { scene: Arc::new(scene), origin: Arc::new(origin), compiled: Arc::default() }
    }

    /// Another version of the scene, which takes over what is compiled.
    pub(crate) fn edited(&self, scene: pathtracer::Scene, origin: SceneOrigin) -> Self {
        let compiled = Arc::new(Mutex::new(self.compiled()));
        Self { compiled, ..Self::new(scene, origin) }
    }

    /// Compiles the scene for a request, and keeps the compilation.
    ///
    /// # Errors
    /// As [`RenderRequest::prepare`].
    pub(crate) fn prepare(&self, request: RenderRequest) -> Result<PreparedRender, String> {
        let earlier = self.taken();
        let prepared = request.prepare(&self.scene, &self.origin, earlier)?;
        *self.lock() = Some(prepared.session.compiled());
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
        self.lock().clone()
    }

    /// The last compilation, which is given up if other objects were compiled, so that these may be
    /// moved in place.
    fn taken(&self) -> Option<CompiledScene> {
        let mut compiled = self.lock();
        if compiled.as_ref().is_some_and(|compiled| compiled.has_objects_of(&self.scene)) {
            compiled.clone()
        } else {
            compiled.take()
        }
    }

    fn lock(&self) -> MutexGuard<'_, Option<CompiledScene>> {
        self.compiled.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
