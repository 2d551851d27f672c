//! General data of the unit for its description.

/// The unit's name, origin and default experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct Info {
    pub(crate) model_identifier: String,
    pub(crate) model_name: String,
    pub(crate) description: String,
    pub(crate) version: String,
    pub(crate) author: String,
    pub(crate) copyright: String,
    pub(crate) license: String,
    pub(crate) experiment: Option<DefaultExperiment>,
}

/// Default experiment: times in s, and a relative tolerance where the model uses one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DefaultExperiment {
    /// Start time, s.
    pub start: f64,
    /// Stop time, s.
    pub stop: f64,
    /// Communication step that the unit is designed for, s.
    pub step: f64,
    /// Relative tolerance.
    pub tolerance: Option<f64>,
}

impl Info {
    /// `model_identifier` is the library's file name without its ending (a C identifier);
    /// `model_name` is for display.
    pub fn new(model_identifier: impl Into<String>, model_name: impl Into<String>) -> Self {
        Self {
            model_identifier: model_identifier.into(),
            model_name: model_name.into(),
            description: String::new(),
            version: String::new(),
            author: String::new(),
            copyright: String::new(),
            license: String::new(),
            experiment: None,
        }
    }

    /// One sentence that describes the unit.
    #[must_use]
    pub fn description(mut self, text: impl Into<String>) -> Self {
        self.description = text.into();
        self
    }

    /// Version of the model, such as `env!("CARGO_PKG_VERSION")`.
    #[must_use]
    pub fn version(mut self, text: impl Into<String>) -> Self {
        self.version = text.into();
        self
    }

    /// Author or organisation.
    #[must_use]
    pub fn author(mut self, text: impl Into<String>) -> Self {
        self.author = text.into();
        self
    }

    /// Copyright notice.
    #[must_use]
    pub fn copyright(mut self, text: impl Into<String>) -> Self {
        self.copyright = text.into();
        self
    }

    /// Licence.
    #[must_use]
    pub fn license(mut self, text: impl Into<String>) -> Self {
        self.license = text.into();
        self
    }

    /// Default experiment: start, stop and communication step in s.
    #[must_use]
    pub fn experiment(mut self, start: f64, stop: f64, step: f64) -> Self {
        self.experiment = Some(DefaultExperiment { start, stop, step, tolerance: None });
        self
    }

    /// Relative tolerance of the default experiment; needs [`Info::experiment`] before it.
    #[must_use]
    pub fn tolerance(mut self, tolerance: f64) -> Self {
        if let Some(experiment) = &mut self.experiment {
            experiment.tolerance = Some(tolerance);
        }
        self
    }
}

/// What a unit cannot do that other units made with this kit can. Each has the reason, for messages.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Limits {
    /// Why communication steps must be equal (`canHandleVariableCommunicationStepSize`).
    pub variable_step: Option<String>,
    /// Why states cannot be saved and serialised (`canGetAndSetFMUstate`, `canSerializeFMUstate`).
    pub states: Option<String>,
    /// Why there are no directional derivatives (`providesDirectionalDerivative`).
    pub directional: Option<String>,
    /// Why a process can have one instance only (`canBeInstantiatedOnlyOncePerProcess`).
    pub instances: Option<String>,
    /// Why another program is needed (`needsExecutionTool`).
    pub alone: Option<String>,
}
