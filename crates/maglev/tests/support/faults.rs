//! Faults of a description: at least one for every rule on it.

use crate::support::DESCRIPTION;

/// A rule, and the change of the sound description that breaks it.
pub const CHANGES: &[(&str, &str, &str)] = &[
    ("description-doctype", "<fmiModelD", "<!DOCTYPE fmiModelDescription><fmiModelD"),
    ("description-xml", "</ModelStructure>", ""),
    ("description-encoding", " encoding=\"UTF-8\"", ""),
    ("description-encoding", "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n", ""),
    ("description-encoding", "encoding=\"UTF-8\"", "encoding=\"US-ASCII\""),
    ("schema-root", "fmiModelDescription", "fmiModel"),
    ("schema-root", "<fmiModelDescription ", "<fmiModelDescription xmlns=\"urn:x\" "),
    ("schema-element", "<BaseUnit s=\"1\"/>", "<BaseUnit s=\"1\"/><Other/>"),
    ("schema-element", "<ModelV", "<q:LogCategories xmlns:q=\"urn:x\"/><ModelV"),
    (
        "schema-order",
        "<ModelV",
        "<LogCategories><Category name=\"a\"/></LogCategories>\
         <TypeDefinitions><SimpleType name=\"T\"><Real/></SimpleType></TypeDefinitions><ModelV",
    ),
    ("schema-missing", "<ModelV", "<LogCategories/><ModelV"),
    ("schema-missing", "<Integer/>", ""),
    ("schema-repeated", "<Integer/>", "<Integer/><Integer/>"),
    ("schema-attribute", "name=\"u\"", "colour=\"red\" name=\"u\""),
    ("schema-attribute", "canInterpolateInputs", "canInterpolateInput"),
    ("schema-attribute", "name=\"u\"", "name=\"u\" xmlns:q=\"urn:x\" q:causality=\"input\""),
    ("schema-attribute", "name=\"u\"", "name=\"u\" xml:lang=\"en\""),
    ("schema-required", " valueReference=\"0\"", ""),
    ("schema-value", "min=\"-10\"", "min=\"low\""),
    ("schema-value", "start=\"false\"", "start=\"False\""),
    ("schema-value", "<Integer start=\"0\"/>", "<Integer start=\"3000000000\"/>"),
    ("schema-value", "start=\"1\" min", "start=\"infinity\" min"),
    ("schema-value", "guid=", "generationDateAndTime=\"yesterday\" guid="),
    ("schema-value", "guid=", "generationDateAndTime=\"2024-13-45T00:00:00Z\" guid="),
    ("schema-value", "guid=", "generationDateAndTime=\"2023-02-30T00:00:00Z\" guid="),
    ("schema-value", "causality=\"input\"", "causality=\"Input\""),
    ("schema-value", "causality=\"input\"", "causality=\" input\""),
    ("schema-value", "variability=\"fixed\"", "variability=\"fixed \""),
    ("schema-value", "start=\"1\" min", "start=\"+INF\" min"),
    ("schema-value", "valueReference=\"3\"", "valueReference=\"\u{a0}3\""),
    ("schema-text", "<ModelV", "stray<ModelV"),
    ("schema-text", "<Integer/>", "<Integer> </Integer>"),
    ("fmi-version", "fmiVersion=\"2.0\"", "fmiVersion=\"2.0.5\""),
    (
        "co-simulation",
        "<CoSimulation modelIdentifier=\"unit\" canHandleVariableCommunicationStepSize=\"true\"\n    \
         canInterpolateInputs=\"true\" maxOutputDerivativeOrder=\"1\"/>",
        "<ModelExchange modelIdentifier=\"unit\"/>",
    ),
    (
        "interface-once",
        "<UnitDefinitions>",
        "<CoSimulation modelIdentifier=\"unit\"/><UnitDefinitions>",
    ),
    ("guid", "guid=\"test-unit\"", "guid=\"\""),
    ("model-name", "modelName=\"integrator\"", "modelName=\" \""),
    ("model-identifier", "modelIdentifier=\"unit\"", "modelIdentifier=\"my-unit\""),
    (
        "model-identifier-length",
        "modelIdentifier=\"unit\"",
        "modelIdentifier=\"a_unit_whose_name_is_longer_than_any_path_on_windows_can_hold\"",
    ),
    ("generation-date", "guid=", "generationDateAndTime=\"2026-01-31T12:00:00+01:00\" guid="),
    (
        "log-categories",
        "<ModelV",
        "<LogCategories><Category name=\"a\"/><Category name=\"a\"/></LogCategories><ModelV",
    ),
    (
        "experiment-interval",
        "<ModelV",
        "<DefaultExperiment startTime=\"1\" stopTime=\"0\"/><ModelV",
    ),
    ("experiment-interval", "<ModelV", "<DefaultExperiment stopTime=\"INF\"/><ModelV"),
    ("experiment-value", "<ModelV", "<DefaultExperiment stepSize=\"0\"/><ModelV"),
    ("experiment-step", "<ModelV", "<DefaultExperiment stopTime=\"1\" stepSize=\"2\"/><ModelV"),
    (
        "annotations",
        "<ModelV",
        "<VendorAnnotations><Tool name=\"t\"/><Tool name=\"t\"/></VendorAnnotations><ModelV",
    ),
    (
        "annotations",
        "<Integer/>",
        "<Integer/><Annotations><Tool name=\"t\"/><Tool name=\"t\"/></Annotations>",
    ),
    ("serialize", "canInter", "canSerializeFMUstate=\"true\" canInter"),
    ("execution-tool", "canInter", "needsExecutionTool=\"true\" canInter"),
    ("once-per-process", "canInter", "canBeInstantiatedOnlyOncePerProcess=\"true\" canInter"),
    ("asynchronous", "canInter", "canRunAsynchronuously=\"true\" canInter"),
    ("multiple-set", "name=\"u\"", "canHandleMultipleSetPerTimeInstant=\"false\" name=\"u\""),
    ("reinit", "<Real unit=\"m\"/>", "<Real unit=\"m\" reinit=\"true\"/>"),
    ("reinit", "<Real unit=\"m\"/>", "<Real unit=\"m\" reinit=\"0\"/>"),
    ("unit-duplicate", "<Unit name=\"mm\">", "<Unit name=\"m\">"),
    ("unit-base", "<BaseUnit s=\"1\"/>", ""),
    ("unit-factor", "factor=\"0.001\"", "factor=\"0\""),
    ("unit-factor", "factor=\"0.001\"", "offset=\"INF\""),
    (
        "display-unit-duplicate",
        "<BaseUnit s=\"1\"/>",
        "<BaseUnit s=\"1\"/><DisplayUnit name=\"h\"/><DisplayUnit name=\"h\"/>",
    ),
    ("unit-defined", "<Real unit=\"m\"/>", "<Real unit=\"parsec\"/>"),
    ("unit-defined", "<Real unit=\"m\"/>", "<Real unit=\"\"/>"),
    ("display-unit-defined", "<Real unit=\"m\"/>", "<Real unit=\"m\" displayUnit=\"inch\"/>"),
    ("display-unit-alone", "<Real unit=\"m\"/>", "<Real displayUnit=\"mm\"/>"),
    (
        "type-duplicate",
        "<ModelV",
        "<TypeDefinitions><SimpleType name=\"T\"><Real/></SimpleType>\
        <SimpleType name=\"T\"><Real/></SimpleType></TypeDefinitions><ModelV",
    ),
    (
        "type-name",
        "<ModelV",
        "<TypeDefinitions><SimpleType name=\"u\"><Real/></SimpleType>\
        </TypeDefinitions><ModelV",
    ),
    (
        "type-range",
        "<ModelV",
        "<TypeDefinitions><SimpleType name=\"T\"><Real min=\"2\" max=\"1\"/>\
        </SimpleType></TypeDefinitions><ModelV",
    ),
    (
        "enumeration-items",
        "<ModelV",
        "<TypeDefinitions><SimpleType name=\"T\"><Enumeration>\
        <Item name=\"a\" value=\"1\"/><Item name=\"b\" value=\"1\"/></Enumeration></SimpleType>\
        </TypeDefinitions><ModelV",
    ),
    (
        "enumeration-items",
        "<ModelV",
        "<TypeDefinitions><SimpleType name=\"T\"><Enumeration>\
        <Item name=\"a\" value=\"7\"/><Item name=\"b\" value=\" 007 \"/></Enumeration></SimpleType>\
        </TypeDefinitions><ModelV",
    ),
    ("declared-type", "<Integer start", "<Integer declaredType=\"Missing\" start"),
    ("variable-duplicate", "name=\"z\"", "name=\"y\""),
    ("variable-empty", "name=\"z\"", "name=\"\""),
    ("variable-flat", "name=\"z\"", "name=\"z&#9;z\""),
    (
        "variability-type",
        "name=\"n\" valueReference=\"1\" causality=\"input\" variability=\"discrete\"",
        "name=\"n\" valueReference=\"1\" causality=\"input\" variability=\"continuous\"",
    ),
    (
        "variability-missing",
        "name=\"n\" valueReference=\"1\" causality=\"input\" variability=\"discrete\"",
        "name=\"n\" valueReference=\"1\" causality=\"input\"",
    ),
    (
        "causality-variability",
        "causality=\"parameter\" variability=\"fixed\"",
        "causality=\"parameter\" variability=\"discrete\"",
    ),
    ("initial", "causality=\"input\"", "causality=\"input\" initial=\"exact\""),
    ("initial", "=\"output\" initial", "=\"parameter\" variability=\"fixed\" initial"),
    ("start-required", "start=\"0\" unit", "unit"),
    ("start-forbidden", "<Integer/>", "<Integer start=\"1\"/>"),
    ("start-finite", "start=\"1\" min", "start=\"NaN\" min"),
    ("start-finite", "start=\"1\" min", "start=\"-INF\" min"),
    ("start-outside-range", "start=\"1\" min", "start=\"11\" min"),
    ("range", "min=\"-10\"", "min=\"100\""),
    ("range-finite", "min=\"-10\"", "min=\"-INF\""),
    ("nominal", "unit=\"s\"/>", "unit=\"s\" nominal=\"-1\"/>"),
    ("nominal", "unit=\"s\"/>", "unit=\"s\" nominal=\"0\"/>"),
    ("derivative", "<Real unit=\"m\"/>", "<Real unit=\"m\" derivative=\"6\"/>"),
    ("derivative", "<Real unit=\"m\"/>", "<Real unit=\"m\" derivative=\"2\"/>"),
    ("derivative", "<Real unit=\"m\"/>", "<Real unit=\"m\" derivative=\"0\"/>"),
    ("derivative", "<Real unit=\"m\"/>", "<Real unit=\"m\" derivative=\"13\"/>"),
    ("derivative-discrete", "<Real unit=\"m\"/>", "<Real unit=\"m\" derivative=\"4\"/>"),
    ("alias-settable", "valueReference=\"4\"", "valueReference=\"3\""),
    ("alias-unit", "valueReference=\"2\" causality", "valueReference=\"3\" causality"),
    ("outputs", "<Unknown index=\"2\" dependencies=\"\"/>", ""),
    ("outputs", "<Unknown index=\"2\" dependencies=\"\"/>", "<Unknown index=\"1\"/>"),
    (
        "initial-unknowns",
        "<InitialUnknowns>\n      <Unknown index=\"2\" dependencies=\"\"/>",
        "<InitialUnknowns>",
    ),
    ("initial-unknowns-excess", "<InitialUnknowns>", "<InitialUnknowns><Unknown index=\"1\"/>"),
    (
        "initial-unknowns-order",
        "<Unknown index=\"3\" dependencies=\"1 5\"/>",
        "<Unknown index=\"12\"/><Unknown index=\"3\" dependencies=\"1 5\"/>",
    ),
    ("structure-index", "index=\"3\"", "index=\"33\""),
    ("structure-index", "dependencies=\"1\"", "dependencies=\"0 1\""),
    ("structure-duplicate", "<Unknown index=\"3\"", "<Unknown index=\"2\"/><Unknown index=\"3\""),
    ("dependencies-order", "dependencies=\"1 5\"", "dependencies=\"5 1\""),
    ("dependencies-known", "dependencies=\"1\"", "dependencies=\"4\""),
    ("dependencies-known-initial", "dependencies=\"1 5\"", "dependencies=\"1 2\""),
    ("dependencies-order", "dependencies=\"1 5\"", "dependencies=\"1 1\""),
    (
        "dependencies-kind",
        "dependencies=\"1\"",
        "dependencies=\"1\" dependenciesKind=\"constant fixed\"",
    ),
    ("dependencies-kind", "index=\"3\" dependencies=\"1\"", "index=\"3\" dependenciesKind=\"\""),
    (
        "dependencies-kind-initial",
        "dependencies=\"1 5\"",
        "dependencies=\"1 5\" dependenciesKind=\"fixed constant\"",
    ),
    (
        "dependencies-kind-type",
        "index=\"8\" dependencies=\"7\"",
        "index=\"8\" dependencies=\"7\" dependenciesKind=\"constant\"",
    ),
];

/// Rules that need more than one replacement.
pub fn larger_changes() -> Vec<(&'static str, String)> {
    let types = |inner: &str| {
        let types = format!(
            "<TypeDefinitions><SimpleType name=\"T\">{inner}</SimpleType></TypeDefinitions>\n\
             <ModelV"
        );
        DESCRIPTION.replacen("<ModelV", &types, 1)
    };
    let variables = |inner: &str| {
        DESCRIPTION.replacen("</ModelVariables>", &format!("{inner}</ModelVariables>"), 1)
    };
    let time = r#"<ScalarVariable name="T" valueReference="9" causality="independent"
        variability="continuous"><Real unit="s"/></ScalarVariable>"#;
    let constants = |second: &str| {
        variables(&format!(
            "<ScalarVariable name=\"k\" valueReference=\"9\" variability=\"constant\"><Real \
             start=\"2\"/></ScalarVariable><ScalarVariable name=\"l\" valueReference=\"9\"{second}\
             </ScalarVariable>"
        ))
    };
    let structured =
        |text: &str| text.replacen("guid=", "variableNamingConvention=\"structured\" guid=", 1);
    let items = types(r#"<Enumeration><Item name="a" value="1"/></Enumeration>"#);
    let derivative = variables(
        r#"<ScalarVariable name="der(y)" valueReference="9" variability="discrete"><Integer/>
        </ScalarVariable>"#,
    );
    vec![
        (
            "declared-type",
            types("<Real/>").replacen("<Integer start", "<Integer declaredType=\"T\" start", 1),
        ),
        (
            "start-enumeration",
            items.replacen(
                "<Integer start=\"0\"",
                "<Enumeration declaredType=\"T\" start=\"4\"",
                1,
            ),
        ),
        ("independent-once", variables(&(time.to_owned() + &time.replace("\"T\"", "\"T2\"")))),
        ("independent-type", variables(&time.replace("Real unit=\"s\"", "Integer"))),
        (
            "schema-root",
            DESCRIPTION
                .replace("<fmiModelDescription", "<q:fmiModelDescription xmlns:q=\"urn:x\"")
                .replace("</fmiModelDescription", "</q:fmiModelDescription"),
        ),
        ("alias-constant", constants("><Real/>")),
        ("alias-value", constants(" variability=\"constant\"><Real start=\"3\"/>")),
        (
            "alias-independent",
            variables(time).replacen("valueReference=\"0\"", "valueReference=\"9\"", 1),
        ),
        (
            "alias-start",
            DESCRIPTION
                .replacen("valueReference=\"2\" causality", "valueReference=\"0\" causality", 1)
                .replace("<Real unit=\"m\"/>", "<Real unit=\"m\" start=\"0\"/>"),
        ),
        (
            "state-causality",
            DESCRIPTION
                .replacen("<Real unit=\"m\"/>", "<Real unit=\"m\" derivative=\"1\"/>", 1)
                .replacen(
                    "</Outputs>",
                    "</Outputs><Derivatives><Unknown index=\"2\"/></Derivatives>",
                    1,
                ),
        ),
        (
            "type-structured",
            structured(&types("<Real/>").replacen("name=\"T\"", "name=\"T-1\"", 1)),
        ),
        ("variable-structured", structured(&DESCRIPTION.replacen("name=\"z\"", "name=\"z z\"", 1))),
        ("variable-der", structured(&derivative)),
        (
            "derivatives",
            DESCRIPTION.replacen(
                "</Outputs>",
                "</Outputs><Derivatives><Unknown index=\"2\"/></Derivatives>",
                1,
            ),
        ),
        (
            "sources",
            DESCRIPTION.replacen(
                "maxOutputDerivativeOrder=\"1\"/>",
                "><SourceFiles><File name=\"all.c\"/></SourceFiles></CoSimulation>",
                1,
            ),
        ),
    ]
}
