//! The printed description, read back, and the faults that a declaration can have.

#![allow(clippy::unwrap_used, reason = "a test program")]

mod common;

use common::{Everything, NONE};
use fmi2_export::*;
use roxmltree::{Document, Node};

fn xml() -> String {
    describe::<Everything>(&Resources::new(NONE)).unwrap()
}

fn child<'a>(node: Node<'a, 'a>, name: &str) -> Node<'a, 'a> {
    node.children().find(|node| node.has_tag_name(name)).unwrap()
}

fn elements<'a>(node: Node<'a, 'a>) -> Vec<Node<'a, 'a>> {
    node.children().filter(Node::is_element).collect()
}

#[test]
fn golden_elements_come_in_the_order_of_the_standard() {
    let xml = xml();
    let document = Document::parse(&xml).unwrap();
    let root = document.root_element();
    let order: Vec<_> = elements(root).iter().map(|node| node.tag_name().name()).collect();
    let expected = [
        "CoSimulation",
        "UnitDefinitions",
        "LogCategories",
        "DefaultExperiment",
        "VendorAnnotations",
        "ModelVariables",
        "ModelStructure",
    ];
    assert_eq!(order, expected);
    assert_eq!(root.attribute("fmiVersion"), Some("2.0"));
    assert_eq!(root.attribute("modelName"), Some("A \"model\" with <everything> & more"));
    assert_eq!(root.attribute("description"), Some("Größe"));
    assert_eq!(root.attribute("variableNamingConvention"), Some("flat"));
    let unit = child(root, "CoSimulation");
    for (name, value) in [
        ("modelIdentifier", "everything"),
        ("canHandleVariableCommunicationStepSize", "true"),
        ("canInterpolateInputs", "true"),
        ("maxOutputDerivativeOrder", "2"),
        ("canRunAsynchronuously", "false"),
        ("canNotUseMemoryManagementFunctions", "true"),
        ("canGetAndSetFMUstate", "true"),
        ("canSerializeFMUstate", "true"),
        ("providesDirectionalDerivative", "true"),
    ] {
        assert_eq!(unit.attribute(name), Some(value), "{name}");
    }
    let experiment = child(root, "DefaultExperiment");
    assert_eq!(experiment.attribute("stepSize"), Some("0.01"));
    assert_eq!(experiment.attribute("tolerance"), Some("1e-6"));
}

/// `y` alone offers derivatives; all inputs take three. The GUID does not follow from it: it is what it
/// was before the annotation came.
#[test]
fn golden_derivatives_are_annotated() {
    let xml = xml();
    let document = Document::parse(&xml).unwrap();
    let root = document.root_element();
    let tools = elements(child(root, "VendorAnnotations"));
    assert_eq!(tools.len(), 1);
    assert_eq!(tools[0].attribute("name"), Some("fmi2-export"));
    // the schema of the standard allows one element per tool
    let content = elements(tools[0]);
    assert_eq!(content.len(), 1);
    assert!(content[0].has_tag_name("Derivatives"));
    assert_eq!(content[0].attribute("inputs"), Some("3"));
    let outputs = elements(content[0]);
    assert_eq!(outputs.len(), 1);
    assert_eq!(outputs[0].attribute("order"), Some("2"));
    let index: usize = outputs[0].attribute("variables").unwrap().parse().unwrap();
    let variables = elements(child(root, "ModelVariables"));
    assert_eq!(variables[index - 1].attribute("name"), Some("y"));
}

#[test]
fn issue_every_unit_used_is_defined_with_base_exponents() {
    let xml = xml();
    let document = Document::parse(&xml).unwrap();
    let root = document.root_element();
    let units = child(root, "UnitDefinitions");
    let find = |name| {
        elements(units).into_iter().find(|unit| unit.attribute("name") == Some(name)).unwrap()
    };
    for real in root.descendants().filter(|node| node.has_tag_name("Real")) {
        let Some(unit) = real.attribute("unit") else { continue };
        let unit = find(unit);
        assert!(elements(unit)[0].has_tag_name("BaseUnit"));
        if let Some(display) = real.attribute("displayUnit") {
            assert!(elements(unit).iter().any(|one| one.attribute("name") == Some(display)));
        }
    }
    let newton = child(find("N"), "BaseUnit");
    let exponents = ["kg", "m", "s", "A"].map(|base| newton.attribute(base));
    assert_eq!(exponents, [Some("1"), Some("1"), Some("-2"), None]);
    let celsius = child(find("K"), "DisplayUnit");
    assert_eq!(celsius.attribute("offset"), Some("-273.15"));
    let names: Vec<_> = elements(units).iter().filter_map(|unit| unit.attribute("name")).collect();
    assert!(names.is_sorted_by(|a, b| a < b), "{names:?}");
}

#[test]
fn issue_variables_follow_the_rules_for_initial_and_start() {
    let xml = xml();
    let document = Document::parse(&xml).unwrap();
    let variables = elements(child(document.root_element(), "ModelVariables"));
    let mut next = std::collections::HashMap::new();
    for variable in &variables {
        let kind = elements(*variable)[0];
        let name = variable.attribute("name").unwrap();
        let reference = variable.attribute("valueReference").unwrap();
        let expected = next.entry(kind.tag_name().name()).or_insert(0);
        assert_eq!(reference, expected.to_string(), "{name}");
        *expected += 1;
        let (causality, initial) =
            (variable.attribute("causality").unwrap(), variable.attribute("initial"));
        let start = kind.attribute("start").is_some();
        match causality {
            "input" => assert!(start && initial.is_none(), "{name}"),
            "parameter" => assert!(start && initial == Some("exact"), "{name}"),
            "output" | "calculatedParameter" => {
                assert!(!start && initial == Some("calculated"), "{name}");
            }
            _ => {}
        }
        let variability = variable.attribute("variability").unwrap();
        assert!(kind.has_tag_name("Real") || variability != "continuous", "{name}");
    }
    let by_name =
        |name| *variables.iter().find(|variable| variable.attribute("name") == Some(name)).unwrap();
    assert_eq!(elements(by_name("v_02"))[0].attribute("start"), Some("2.0"));
    assert_eq!(by_name("v_02").attribute("description"), Some("input 2"));
    assert_eq!(elements(by_name("label"))[0].attribute("start"), Some("a & <b> \"c\" % #"));
    assert_eq!(by_name("pi").attribute("variability"), Some("constant"));
    let pi: f64 = elements(by_name("pi"))[0].attribute("start").unwrap().parse().unwrap();
    assert_eq!(pi, std::f64::consts::PI);
}

/// Name of each unknown with the names that it depends on; `None` where nothing is said.
fn dependencies(document: &Document<'_>, list: &str) -> Vec<(String, Option<Vec<String>>)> {
    let root = document.root_element();
    let variables = child(root, "ModelVariables");
    let variables: Vec<_> = variables.children().filter(Node::is_element).collect();
    let name = |index: &str| {
        let index: usize = index.parse().unwrap();
        variables[index - 1].attribute("name").unwrap().to_owned()
    };
    let structure = child(child(root, "ModelStructure"), list);
    let mut last = 0;
    let mut lists = Vec::new();
    for unknown in structure.children().filter(Node::is_element) {
        let index: usize = unknown.attribute("index").unwrap().parse().unwrap();
        assert!(index > last, "unknowns are sorted and not twice there");
        last = index;
        let knowns = unknown.attribute("dependencies").map(|list| {
            let indices: Vec<usize> =
                list.split_whitespace().map(|index| index.parse().unwrap()).collect();
            assert!(indices.is_sorted_by(|a, b| a < b));
            list.split_whitespace().map(name).collect()
        });
        lists.push((name(unknown.attribute("index").unwrap()), knowns));
    }
    lists
}

#[test]
fn issue_model_structure_lists_outputs_and_dependencies() {
    let xml = xml();
    let document = Document::parse(&xml).unwrap();
    let some = |names: &[&str]| Some(names.iter().map(|name| (*name).to_owned()).collect());
    let entry = |name: &str, knowns: Option<Vec<String>>| (name.to_owned(), knowns);
    let expected = vec![
        entry("y", some(&["u"])),
        entry("z_01", some(&["v_01"])),
        entry("z_02", some(&["v_02"])),
        entry("z_03", some(&["v_03"])),
        entry("steps", some(&[])),
        entry("odd", None),
        entry("echo", some(&["mode", "switch", "note"])),
        entry("told", some(&[])),
    ];
    assert_eq!(dependencies(&document, "Outputs"), expected);
    let initially = dependencies(&document, "InitialUnknowns");
    let expected = [
        entry("y", some(&["gain", "offset", "u"])),
        entry("steps", some(&[])),
        entry("odd", None),
        entry("product", some(&["gain", "count"])),
    ];
    for one in expected {
        assert!(initially.contains(&one), "{one:?} in {initially:?}");
    }
    assert_eq!(initially.len(), 9);
}

#[test]
fn issue_the_guid_follows_the_content() {
    let guid = |xml: &str| {
        let document = Document::parse(xml).unwrap();
        document.root_element().attribute("guid").unwrap().to_owned()
    };
    assert_eq!(guid(&xml()), guid(&xml()));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("extra.txt");
    let of = |content: &str| {
        std::fs::write(&path, content).unwrap();
        guid(&describe::<Everything>(&Resources::new(folder.path())).unwrap())
    };
    let (first, second) = (of("one"), of("two"));
    assert_ne!(first, second);
    assert_ne!(first, guid(&xml()));
    assert_eq!(of("one"), first);
    // An instance goes with the resources that it finds.
    assert!(testing::TestInstance::new::<Everything>(folder.path()).is_ok());
    std::fs::write(&path, "changed").unwrap();
    let location = folder.path().to_str().unwrap();
    let failure =
        testing::TestInstance::instantiate::<Everything>("x", &first, location).unwrap_err();
    assert!(failure.to_string().contains("a file in resources was changed"), "{failure}");
}

#[test]
fn issue_resources_are_found_by_odd_uris() {
    let folder = tempfile::tempdir().unwrap();
    let odd = folder.path().join("grüße 100% & #1");
    std::fs::create_dir(&odd).unwrap();
    std::fs::write(odd.join("extra.txt"), "name").unwrap();
    let xml = describe::<Everything>(&Resources::new(&odd)).unwrap();
    let document = Document::parse(&xml).unwrap();
    assert_eq!(document.root_element().attribute("modelName"), Some("name"));
    let guid = document.root_element().attribute("guid").unwrap();
    let path = odd.to_str().unwrap();
    let encoded = path
        .replace('%', "%25")
        .replace(' ', "%20")
        .replace('#', "%23")
        .replace('ü', "%C3%BC")
        .replace('ß', "%c3%9f");
    for location in [
        format!("file://{encoded}"),
        format!("file://{encoded}/"),
        format!("file:{encoded}"),
        format!("file://localhost{encoded}"),
        path.to_owned(),
    ] {
        // With other resources the GUID would not fit.
        testing::TestInstance::instantiate::<Everything>("x", guid, &location).unwrap();
    }
}

/// A unit with whatever declarations.
macro_rules! faulty {
    ($table:ident => $declare:expr) => {{
        struct Faulty;
        impl Model for Faulty {
            type State = ();
            fn declare(_: &Resources, $table: &mut Interface) -> Result<Self, Error> {
                $table.describe(Info::new("faulty", "Faulty"));
                $declare;
                Ok(Self)
            }
            fn initialise(&mut self, _: &mut Values, _: f64) -> Result<(), Error> {
                Ok(())
            }
            fn outputs(&mut self, _: &(), _: &mut Values, _: f64) -> Result<(), Error> {
                Ok(())
            }
            fn step(&mut self, _: &mut (), _: &mut Values, _: Step) -> Result<(), Error> {
                Ok(())
            }
        }
        match describe::<Faulty>(&Resources::new(NONE)) {
            Ok(_) => "no fault".to_owned(),
            Err(error) => error.to_string(),
        }
    }};
}

#[test]
fn issue_faulty_declarations_are_named() {
    let cases = [
        (faulty!(t => t.real("x").output().done()), "no fault"),
        (faulty!(t => (t.real("x").output().done(), t.real("x").local().done())), "twice"),
        (faulty!(t => t.real("x.y").output().done()), "x.y: a name is a letter"),
        (faulty!(t => t.real("").output().done()), "a name is a letter"),
        (faulty!(t => t.real("a".repeat(56)).output().done()), "56 characters, at most 55"),
        (faulty!(t => t.real("x").done()), "x needs one of input"),
        (faulty!(t => t.real("x").input(0.0).output().done()), "two roles"),
        (faulty!(t => t.real("x").input(f64::NAN).done()), "must be finite"),
        (faulty!(t => t.real("x").parameter(2.0).max(1.0).done()), "start 2.0 is above max 1.0"),
        (faulty!(t => t.integer("x").parameter(0).min(1).done()), "start 0 is below min 1"),
        (faulty!(t => t.real("x").output().min(2.0).max(1.0).done()), "min 2.0 is above max 1.0"),
        (faulty!(t => t.real("x").output().nominal(0.0).done()), "nominal must be greater"),
        (faulty!(t => t.real("x").output().display("mm").done()), "no display unit \"mm\""),
        (faulty!(t => t.real("x").output().description("a\nb").done()), "control character"),
        (faulty!(t => t.reals("x", 2).input(0.0).starts([1.0]).done()), "1 start values for 2"),
        (
            faulty!(t => {
                t.real("x").output().unit(UnitOfMeasure::new("N").m(1)).done();
                t.real("y").output().unit(UnitOfMeasure::NEWTON).done()
            }),
            "y: unit \"N\" is defined twice, differently",
        ),
        (
            faulty!(t => {
                let (x, y) = (t.real("x").output().done(), t.real("y").output().done());
                t.depends(x, &[y]);
            }),
            "x cannot depend on y",
        ),
        (
            faulty!(t => {
                let x = t.real("x").input(0.0).done();
                t.depends(x, &[x]);
            }),
            "x: only outputs have dependencies",
        ),
        (
            faulty!(t => {
                let (x, y) = (t.reals("x", 2).output().done(), t.reals("y", 3).input(0.0).done());
                t.depends_elementwise(x, y);
            }),
            "of 2 variables on 3",
        ),
        (faulty!(t => t.describe(Info::new("no identifier", "x"))), "C identifier"),
        (faulty!(t => t.describe(Info::new("x", ""))), "a model name"),
        (
            faulty!(t => t.describe(Info::new("x", "x").experiment(1.0, 1.0, 0.1))),
            "the default experiment needs",
        ),
    ];
    for (text, part) in cases {
        assert!(text.contains(part), "{part:?} in {text:?}");
    }
}

#[test]
fn issue_rows_count_with_leading_zeros() {
    struct Rows;
    impl Model for Rows {
        type State = ();
        fn declare(_: &Resources, t: &mut Interface) -> Result<Self, Error> {
            t.describe(Info::new("rows", "Rows"));
            t.reals("none", 0).input(0.0).done();
            t.reals("two", 99).input(0.0).done();
            let three = t.reals("three", 100).output().done();
            assert_eq!(three.get(99).value_reference(), 198);
            assert_eq!(three.checked_get(100), None);
            Ok(Self)
        }
        fn initialise(&mut self, _: &mut Values, _: f64) -> Result<(), Error> {
            Ok(())
        }
        fn outputs(&mut self, _: &(), _: &mut Values, _: f64) -> Result<(), Error> {
            Ok(())
        }
        fn step(&mut self, _: &mut (), _: &mut Values, _: Step) -> Result<(), Error> {
            Ok(())
        }
    }
    let xml = describe::<Rows>(&Resources::new(NONE)).unwrap();
    for name in ["two_01", "two_99", "three_001", "three_100"] {
        assert!(xml.contains(&format!("name=\"{name}\"")), "{name}");
    }
    assert!(!xml.contains("none_"));
}
