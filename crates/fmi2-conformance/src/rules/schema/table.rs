//! The XML schema of FMI 2.0 as a table: elements, their attributes and their order.

use super::types::Kind::{
    self, Boolean, Date, Indices, Integer, ManyOf, OneOf, Real, Text, Unsigned,
};

pub(super) struct Element {
    pub(super) name: &'static str,
    pub(super) required: &'static [(&'static str, Kind)],
    pub(super) optional: &'static [(&'static str, Kind)],
    pub(super) content: Content,
}

pub(super) enum Content {
    /// No element and no text, not even white space.
    Empty,
    /// Groups in this order.
    Groups(&'static [Group]),
    /// At most one element, of any name.
    OneOfAny,
    /// Any attributes, elements and text.
    Anything,
}

/// `least` to `most` elements out of `any_of`.
pub(super) struct Group {
    pub(super) any_of: &'static [&'static Element],
    pub(super) least: usize,
    pub(super) most: usize,
    /// How often the elements of `any_of` may repeat in their order; 0: any order.
    pub(super) rounds: usize,
}

const fn group(any_of: &'static [&'static Element], least: usize, most: usize) -> Group {
    Group { any_of, least, most, rounds: 0 }
}

const fn one(any_of: &'static [&'static Element]) -> Group {
    group(any_of, 1, 1)
}

const fn maybe(any_of: &'static [&'static Element]) -> Group {
    group(any_of, 0, 1)
}

const fn many(any_of: &'static [&'static Element]) -> Group {
    group(any_of, 1, usize::MAX)
}

const fn leaf(name: &'static str, required: &'static [(&'static str, Kind)]) -> Element {
    Element { name, required, optional: &[], content: Content::Empty }
}

const fn list(name: &'static str, content: &'static [Group]) -> Element {
    Element { name, required: &[], optional: &[], content: Content::Groups(content) }
}

const fn anything(name: &'static str) -> Element {
    Element { name, required: &[], optional: &[], content: Content::Anything }
}

pub(super) static ROOT: Element = Element {
    name: "fmiModelDescription",
    required: &[("fmiVersion", Text), ("modelName", Text), ("guid", Text)],
    optional: &[
        ("description", Text),
        ("author", Text),
        ("version", Text),
        ("copyright", Text),
        ("license", Text),
        ("generationTool", Text),
        ("generationDateAndTime", Date),
        ("variableNamingConvention", OneOf(&["flat", "structured"])),
        ("numberOfEventIndicators", Unsigned),
    ],
    content: Content::Groups(&[
        // twice each in order, and even none; rules of their own demand one
        Group { any_of: &[&MODEL_EXCHANGE, &CO_SIMULATION], least: 0, most: 4, rounds: 2 },
        maybe(&[&UNIT_DEFINITIONS]),
        maybe(&[&TYPE_DEFINITIONS]),
        maybe(&[&LOG_CATEGORIES]),
        maybe(&[&DEFAULT_EXPERIMENT]),
        maybe(&[&VENDOR_ANNOTATIONS]),
        one(&[&MODEL_VARIABLES]),
        one(&[&MODEL_STRUCTURE]),
    ]),
};

static MODEL_EXCHANGE: Element = Element {
    name: "ModelExchange",
    required: &[("modelIdentifier", Text)],
    optional: &[
        ("needsExecutionTool", Boolean),
        ("completedIntegratorStepNotNeeded", Boolean),
        ("canBeInstantiatedOnlyOncePerProcess", Boolean),
        ("canNotUseMemoryManagementFunctions", Boolean),
        ("canGetAndSetFMUstate", Boolean),
        ("canSerializeFMUstate", Boolean),
        ("providesDirectionalDerivative", Boolean),
    ],
    content: Content::Groups(&[maybe(&[&SOURCE_FILES])]),
};

static CO_SIMULATION: Element = Element {
    name: "CoSimulation",
    required: &[("modelIdentifier", Text)],
    optional: &[
        ("needsExecutionTool", Boolean),
        ("canHandleVariableCommunicationStepSize", Boolean),
        ("canInterpolateInputs", Boolean),
        ("maxOutputDerivativeOrder", Unsigned),
        ("canRunAsynchronuously", Boolean),
        ("canBeInstantiatedOnlyOncePerProcess", Boolean),
        ("canNotUseMemoryManagementFunctions", Boolean),
        ("canGetAndSetFMUstate", Boolean),
        ("canSerializeFMUstate", Boolean),
        ("providesDirectionalDerivative", Boolean),
    ],
    content: Content::Groups(&[maybe(&[&SOURCE_FILES])]),
};

static SOURCE_FILES: Element = list("SourceFiles", &[many(&[&FILE])]);
static FILE: Element = leaf("File", &[("name", Text)]);

static UNIT_DEFINITIONS: Element = list("UnitDefinitions", &[many(&[&UNIT])]);
static UNIT: Element = Element {
    name: "Unit",
    required: &[("name", Text)],
    optional: &[],
    content: Content::Groups(&[maybe(&[&BASE_UNIT]), group(&[&DISPLAY_UNIT], 0, usize::MAX)]),
};
static BASE_UNIT: Element = Element {
    name: "BaseUnit",
    required: &[],
    optional: &[
        ("kg", Integer),
        ("m", Integer),
        ("s", Integer),
        ("A", Integer),
        ("K", Integer),
        ("mol", Integer),
        ("cd", Integer),
        ("rad", Integer),
        ("factor", Real),
        ("offset", Real),
    ],
    content: Content::Empty,
};
static DISPLAY_UNIT: Element = Element {
    name: "DisplayUnit",
    required: &[("name", Text)],
    optional: &[("factor", Real), ("offset", Real)],
    content: Content::Empty,
};

static TYPE_DEFINITIONS: Element = list("TypeDefinitions", &[many(&[&SIMPLE_TYPE])]);
static SIMPLE_TYPE: Element = Element {
    name: "SimpleType",
    required: &[("name", Text)],
    optional: &[("description", Text)],
    content: Content::Groups(&[one(&[
        &TYPE_REAL,
        &TYPE_INTEGER,
        &TYPE_BOOLEAN,
        &TYPE_STRING,
        &TYPE_ENUMERATION,
    ])]),
};
static TYPE_REAL: Element = Element {
    name: "Real",
    required: &[],
    optional: &[
        ("quantity", Text),
        ("unit", Text),
        ("displayUnit", Text),
        ("relativeQuantity", Boolean),
        ("min", Real),
        ("max", Real),
        ("nominal", Real),
        ("unbounded", Boolean),
    ],
    content: Content::Empty,
};
static TYPE_INTEGER: Element = Element {
    name: "Integer",
    required: &[],
    optional: &[("quantity", Text), ("min", Integer), ("max", Integer)],
    content: Content::Empty,
};
// the schema gives these two no type, which allows everything
static TYPE_BOOLEAN: Element = anything("Boolean");
static TYPE_STRING: Element = anything("String");
static TYPE_ENUMERATION: Element = Element {
    name: "Enumeration",
    required: &[],
    optional: &[("quantity", Text)],
    content: Content::Groups(&[many(&[&ITEM])]),
};
static ITEM: Element = Element {
    name: "Item",
    required: &[("name", Text), ("value", Integer)],
    optional: &[("description", Text)],
    content: Content::Empty,
};

static LOG_CATEGORIES: Element = list("LogCategories", &[many(&[&CATEGORY])]);
static CATEGORY: Element = Element {
    name: "Category",
    required: &[("name", Text)],
    optional: &[("description", Text)],
    content: Content::Empty,
};

static DEFAULT_EXPERIMENT: Element = Element {
    name: "DefaultExperiment",
    required: &[],
    optional: &[("startTime", Real), ("stopTime", Real), ("tolerance", Real), ("stepSize", Real)],
    content: Content::Empty,
};

static VENDOR_ANNOTATIONS: Element = list("VendorAnnotations", &[many(&[&TOOL])]);
static ANNOTATIONS: Element = list("Annotations", &[many(&[&TOOL])]);
static TOOL: Element = Element {
    name: "Tool",
    required: &[("name", Text)],
    optional: &[],
    content: Content::OneOfAny,
};

static MODEL_VARIABLES: Element = list("ModelVariables", &[many(&[&SCALAR_VARIABLE])]);
static SCALAR_VARIABLE: Element = Element {
    name: "ScalarVariable",
    required: &[("name", Text), ("valueReference", Unsigned)],
    optional: &[
        ("description", Text),
        (
            "causality",
            OneOf(&["parameter", "calculatedParameter", "input", "output", "local", "independent"]),
        ),
        ("variability", OneOf(&["constant", "fixed", "tunable", "discrete", "continuous"])),
        ("initial", OneOf(&["exact", "approx", "calculated"])),
        ("canHandleMultipleSetPerTimeInstant", Boolean),
    ],
    content: Content::Groups(&[
        one(&[&REAL, &INTEGER, &BOOLEAN, &STRING, &ENUMERATION]),
        maybe(&[&ANNOTATIONS]),
    ]),
};
static REAL: Element = Element {
    name: "Real",
    required: &[],
    optional: &[
        ("declaredType", Text),
        ("quantity", Text),
        ("unit", Text),
        ("displayUnit", Text),
        ("relativeQuantity", Boolean),
        ("min", Real),
        ("max", Real),
        ("nominal", Real),
        ("unbounded", Boolean),
        ("start", Real),
        ("derivative", Unsigned),
        ("reinit", Boolean),
    ],
    content: Content::Empty,
};
static INTEGER: Element = Element {
    name: "Integer",
    required: &[],
    optional: &[
        ("declaredType", Text),
        ("quantity", Text),
        ("min", Integer),
        ("max", Integer),
        ("start", Integer),
    ],
    content: Content::Empty,
};
static BOOLEAN: Element = Element {
    name: "Boolean",
    required: &[],
    optional: &[("declaredType", Text), ("start", Boolean)],
    content: Content::Empty,
};
static STRING: Element = Element {
    name: "String",
    required: &[],
    optional: &[("declaredType", Text), ("start", Text)],
    content: Content::Empty,
};
static ENUMERATION: Element = Element {
    name: "Enumeration",
    required: &[("declaredType", Text)],
    optional: &[("quantity", Text), ("min", Integer), ("max", Integer), ("start", Integer)],
    content: Content::Empty,
};

static MODEL_STRUCTURE: Element = list(
    "ModelStructure",
    &[maybe(&[&OUTPUTS]), maybe(&[&DERIVATIVES]), maybe(&[&INITIAL_UNKNOWNS])],
);
static OUTPUTS: Element = list("Outputs", &[many(&[&UNKNOWN])]);
static DERIVATIVES: Element = list("Derivatives", &[many(&[&UNKNOWN])]);
static INITIAL_UNKNOWNS: Element = list("InitialUnknowns", &[many(&[&UNKNOWN])]);
static UNKNOWN: Element = Element {
    name: "Unknown",
    required: &[("index", Unsigned)],
    optional: &[
        ("dependencies", Indices),
        ("dependenciesKind", ManyOf(&["dependent", "constant", "fixed", "tunable", "discrete"])),
    ],
    content: Content::Empty,
};
