//! A scene with its origin and its compilation, for other threads.

use std::sync::{Arc, Mutex, PoisonError};

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
        let earlier = self.compiled();
        let prepared = request.prepare(&self.scene, &self.origin, earlier.as_ref())?;
        self.keep(prepared.session.compiled());
        Ok(prepared)
    }

    /// Compiles the surfaces for ray queries.
    ///
    /// # Errors
    /// If the scene is inconsistent.
    pub(crate) fn queries(&self) -> Result<SceneQueries, pathtracer::CompileError> {
        match self.compiled() {
            Some(earlier) => SceneQueries::edited(&earlier, &self.scene),
            None => SceneQueries::new(&self.scene),
        }
    }

    fn compiled(&self) -> Option<CompiledScene> {
        self.compiled.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn keep(&self, compiled: CompiledScene) {
        let old = self.compiled.lock().unwrap_or_else(PoisonError::into_inner).replace(compiled);
        drop(old);
    }
}
