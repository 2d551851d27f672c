//! Annotations: our own, which hold what SSP cannot say, and those of others that state a step size.

use fmi2_import::xml::Plain as _;
use roxmltree::Node;

use crate::xml::{SSC, SSD, child, double, listed};

/// Type of our annotation. It contains an element `Settings`, whose text is JSON. On the description that is a part of a scenario, as `maglev schema` describes it;
/// on a connection, a part of a connection of a scenario.
pub const TYPE: &str = "org.maglev-cosimulation.scenario";
/// Namespace of the element in our annotation.
pub(crate) const NAMESPACE: &str = "urn:maglev-cosimulation:ssp";
/// Name of the element in our annotation.
pub(crate) const SETTINGS: &str = "Settings";
/// Type of OMSimulator's annotation.
pub(crate) const OMSIMULATOR: &str = "org.openmodelica";
/// Type of the annotation of the Open Simulation Platform: libcosim, ecos.
pub(crate) const OSP: &str = "com.opensimulationplatform";
/// Namespace of OMSimulator's elements.
pub(crate) const OMSIMULATOR_NAMESPACE: &str =
    "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd";
/// Namespace of the elements of the Open Simulation Platform.
pub(crate) const OSP_NAMESPACE: &str = "http://opensimulationplatform.com/SSP/OSPAnnotations";

/// An annotation.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Annotation {
    /// Its type, in reverse-domain style.
    pub(crate) kind: String,
    /// The element that has it.
    pub(crate) place: String,
    /// Position of its file among those of the description.
    pub(crate) origin: usize,
    /// Path of the system that this file describes, with a slash; empty for the outermost.
    pub(crate) within: String,
    /// What it says, if that is known.
    pub(crate) meaning: Meaning,
}

/// What an annotation says.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Meaning {
    /// Text of ours.
    Ours(String),
    /// A fixed communication step (s).
    Step(f64),
    /// Nothing that is used.
    Unused,
}

impl Annotation {
    /// All annotations of an element.
    pub(crate) fn read_all(node: Node<'_, '_>, place: &str) -> Vec<Self> {
        listed(node, (SSD, "Annotations"), (SSC, "Annotation"))
            .map(|it| {
                let kind = it.attr("type").unwrap_or_default().to_owned();
                let meaning = match kind.as_str() {
                    TYPE => {
                        let settings = child(it, (NAMESPACE, SETTINGS));
                        let text = settings.and_then(|it| it.text());
                        Meaning::Ours(text.unwrap_or_default().to_owned())
                    }
                    OMSIMULATOR => step(it, "FixedStepMaster", "stepSize"),
                    OSP => step(it, "FixedStepAlgorithm", "baseStepSize"),
                    _ => Meaning::Unused,
                };
                Self { kind, place: place.to_owned(), origin: 0, within: String::new(), meaning }
            })
            .collect()
    }
}

/// A step size in an element below.
fn step(node: Node<'_, '_>, element: &str, attribute: &str) -> Meaning {
    let found = node.descendants().filter(|it| it.tag_name().name() == element);
    let mut steps = found.filter_map(|it| double(it.attr(attribute)?));
    steps.find(|step| step.is_finite() && *step > 0.0).map_or(Meaning::Unused, Meaning::Step)
}
