"""Descriptions written the way well-known tools write them, cut down to what is peculiar to each: the findings of
`maglev validate` are those that the standard's text supports, and no others."""

import pytest

import fmu_cases as cases


def description(head, body):
    return f"{cases.HEAD}<fmiModelDescription fmiVersion=\"2.0\" {head}>{body}</fmiModelDescription>"


DYMOLA = description(
    """modelName="Modelica.Mechanics.Rotational.Examples.First" guid="{b4d1c9f2-26b8-4d3f-9bd5-2c4a2a8f6a10}"
    description="First example: simple drive train" version="3.2.3" generationTool="Dymola Version 2021x (64-bit), 2020-10-09"
    generationDateAndTime="2021-01-12T09:13:15Z" variableNamingConvention="structured" numberOfEventIndicators="24" """,
    """<ModelExchange modelIdentifier="First" canNotUseMemoryManagementFunctions="true" canGetAndSetFMUstate="true"
    canSerializeFMUstate="true" providesDirectionalDerivative="true"/>
  <CoSimulation modelIdentifier="First" canHandleVariableCommunicationStepSize="true" canInterpolateInputs="true"
    maxOutputDerivativeOrder="1" canRunAsynchronuously="true" canNotUseMemoryManagementFunctions="true"
    canGetAndSetFMUstate="true" canSerializeFMUstate="true" providesDirectionalDerivative="true"/>
  <UnitDefinitions>
    <Unit name="rad"><BaseUnit rad="1"/><DisplayUnit name="deg" factor="57.29577951308232"/></Unit>
    <Unit name="rad/s"><BaseUnit s="-1" rad="1"/></Unit>
    <Unit name="rad/s2"><BaseUnit s="-2" rad="1"/></Unit>
    <Unit name="K"><BaseUnit K="1"/><DisplayUnit name="degC" offset="-273.15"/></Unit>
  </UnitDefinitions>
  <TypeDefinitions>
    <SimpleType name="Modelica.SIunits.Angle"><Real quantity="Angle" unit="rad" displayUnit="deg"/></SimpleType>
    <SimpleType name="Modelica.SIunits.AngularVelocity"><Real quantity="AngularVelocity" unit="rad/s" displayUnit="rev/min"/></SimpleType>
    <SimpleType name="Modelica.SIunits.Temperature"><Real quantity="ThermodynamicTemperature" unit="K" displayUnit="degC"
      min="0.0" max="1E+100" nominal="300.0"/></SimpleType>
    <SimpleType name="Modelica.Blocks.Types.Init"><Enumeration quantity="Modelica.Blocks.Types.Init">
      <Item name="NoInit" value="1" description="No initialization (start values are used as guess values)"/>
      <Item name="SteadyState" value="2"/></Enumeration></SimpleType>
  </TypeDefinitions>
  <LogCategories><Category name="logEvents"/><Category name="logStatusError"/><Category name="logAll"/></LogCategories>
  <DefaultExperiment startTime="0.0" stopTime="1.5" tolerance="0.0001"/>
  <ModelVariables>
  <!-- Index for next variable = 1 -->
  <ScalarVariable name="T_env" valueReference="16777216" causality="parameter" variability="tunable">
    <Real declaredType="Modelica.SIunits.Temperature" start="263.15" min="-1.0"/></ScalarVariable>
  <ScalarVariable name="controller.initType" valueReference="16777217" causality="parameter" variability="fixed">
    <Enumeration declaredType="Modelica.Blocks.Types.Init" min="1" max="2" start="1"/></ScalarVariable>
  <ScalarVariable name="phi" valueReference="33554432" causality="local" variability="continuous" initial="exact">
    <Real declaredType="Modelica.SIunits.Angle" start="0"/></ScalarVariable>
  <ScalarVariable name="der(phi)" valueReference="33554433" causality="local" variability="continuous">
    <Real unit="rad/s" derivative="3"/></ScalarVariable>
  <ScalarVariable name="w" valueReference="33554433" causality="output" variability="continuous">
    <Real declaredType="Modelica.SIunits.AngularVelocity"/></ScalarVariable>
  <ScalarVariable name="inertia.flange_a.'phi 1'[1]" valueReference="33554432" causality="local" variability="continuous">
    <Real unit="rad" displayUnit="deg"/></ScalarVariable>
  <ScalarVariable name="tau" valueReference="352321536" causality="input" variability="continuous"><Real start="0.0"/></ScalarVariable>
  <ScalarVariable name="clutch.mode" valueReference="637534208" causality="local" variability="discrete"><Integer min="-2" max="2"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="5" dependencies="3 7" dependenciesKind="dependent constant"/></Outputs>
    <Derivatives><Unknown index="4" dependencies="3"/></Derivatives>
    <InitialUnknowns><Unknown index="4" dependencies="3"/><Unknown index="5" dependencies="1 3 7"/></InitialUnknowns>
  </ModelStructure>""")

OPENMODELICA = description(
    """modelName="Chain" guid="{7e57b8a1-1c55-4e5e-8a57-9d2c6b3a4f11}" description="" generationTool="OpenModelica Compiler OMCompiler v1.22.0"
    generationDateAndTime="2023-11-02T10:00:00Z" variableNamingConvention="structured" numberOfEventIndicators="0" """,
    """<CoSimulation modelIdentifier="Chain" needsExecutionTool="false" canHandleVariableCommunicationStepSize="true"
    canInterpolateInputs="true" maxOutputDerivativeOrder="1" canRunAsynchronuously = "false" canBeInstantiatedOnlyOncePerProcess="false"
    canNotUseMemoryManagementFunctions="false" canGetAndSetFMUstate="true" canSerializeFMUstate="false" providesDirectionalDerivative="false">
    <SourceFiles><File name="Chain.c" /><File name="util/base_array.c" /><File name="./gc/alloc.c" /></SourceFiles>
  </CoSimulation>
  <UnitDefinitions><Unit name="1"><BaseUnit /></Unit><Unit name="m/s"><BaseUnit m="1" s="-1" /></Unit></UnitDefinitions>
  <LogCategories><Category name="logEvents" /><Category name="logFmi2Call" /></LogCategories>
  <DefaultExperiment startTime="0.0" stopTime="1.0" tolerance="1e-06" stepSize="0.002"/>
  <VendorAnnotations><Tool name="OpenModelica"><ModelVariables><ScalarVariable name="h"/></ModelVariables></Tool></VendorAnnotations>
  <ModelVariables>
  <!-- Index of variable = "1" -->
  <ScalarVariable name="h" valueReference="0" description="height" variability="continuous" causality="local" initial="exact">
    <Real start="1.0"/><Annotations><Tool name="OpenModelica"><Variable isProtected="false" hideResult="false"/></Tool></Annotations></ScalarVariable>
  <ScalarVariable name="der(h)" valueReference="1" variability="continuous" causality="local" initial="calculated"><Real derivative="1"/></ScalarVariable>
  <ScalarVariable name="n" valueReference="2" variability="discrete" causality="output"><Real unit="1"/></ScalarVariable>
  <ScalarVariable name="flying" valueReference="0" variability="discrete" causality="local"><Boolean/></ScalarVariable>
  <ScalarVariable name="pi" valueReference="3" variability="constant" causality="local"><Real start="3.141592653589793"/></ScalarVariable>
  <ScalarVariable name="world.pi" valueReference="3" variability="constant" causality="local"><Real start="3.14159265358979300"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="3" dependencies="1" dependenciesKind="dependent" /></Outputs>
    <Derivatives><Unknown index="2" dependencies="1" dependenciesKind="dependent" /></Derivatives>
    <InitialUnknowns><Unknown index="2" dependencies="1" dependenciesKind="dependent"/><Unknown index="3"/></InitialUnknowns>
  </ModelStructure>""")

JMODELICA = description(
    """modelName="Pendulum" guid="3a5e1d8a9c7e41b2" description="" author="" version="" generationTool="JModelica.org"
    generationDateAndTime="2017-06-01T08:00:00" variableNamingConvention="structured" numberOfEventIndicators="0" """,
    """<CoSimulation modelIdentifier="Pendulum" needsExecutionTool="false" canHandleVariableCommunicationStepSize="true"
    canInterpolateInputs="true" maxOutputDerivativeOrder="2" canGetAndSetFMUstate="true" canSerializeFMUstate="true" providesDirectionalDerivative="true">
    <SourceFiles><File name="Pendulum.c"/></SourceFiles></CoSimulation>
  <UnitDefinitions><Unit name="N.m"><BaseUnit kg="1" m="2" s="-2"/></Unit><Unit name="%"/></UnitDefinitions>
  <TypeDefinitions><SimpleType name="Modelica.SIunits.Torque" description=""><Real quantity="Torque" unit="N.m" relativeQuantity="false"/></SimpleType></TypeDefinitions>
  <LogCategories><Category name="logLevel1" description="Log level 1"/></LogCategories>
  <ModelVariables>
  <ScalarVariable name="_cs_solver" valueReference="0" description="Specifies the internal solver used in Co-Simulation" causality="parameter" variability="fixed" initial="exact"><Integer start="0"/></ScalarVariable>
  <ScalarVariable name="tau" valueReference="1" causality="input" variability="continuous"><Real declaredType="Modelica.SIunits.Torque" relativeQuantity="false" start="0.0"/></ScalarVariable>
  <ScalarVariable name="load" valueReference="2" causality="output" variability="continuous" initial="calculated"><Real relativeQuantity="false" unit="%"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="3" dependencies="2" dependenciesKind="constant"/></Outputs>
    <InitialUnknowns><Unknown index="3" dependencies="2"/></InitialUnknowns></ModelStructure>""")

TWENTY_SIM = description(
    """modelName="watertank" guid="{cfc65592-9ece-4563-9705-1581b6e7071c}" author="A. Author" version="1.0" license="-"
    generationTool="20-sim" generationDateAndTime="2018-05-11T09:25:41Z" variableNamingConvention="structured" numberOfEventIndicators="0" """,
    """<CoSimulation modelIdentifier="watertank" needsExecutionTool="false" canHandleVariableCommunicationStepSize="true"
    canInterpolateInputs="false" maxOutputDerivativeOrder="0" canNotUseMemoryManagementFunctions="true" canGetAndSetFMUstate="false">
    <SourceFiles><File name="EulerAngles.c"/><File name="fmi2Functions.c"/></SourceFiles></CoSimulation>
  <UnitDefinitions><Unit name="m"><BaseUnit m="1"/></Unit></UnitDefinitions>
  <DefaultExperiment startTime="0.0" stopTime="10.0" stepSize="0.1"/>
  <VendorAnnotations><Tool name="20-sim"><Solver><Param name="step" unit="s">0.1</Param></Solver></Tool></VendorAnnotations>
  <ModelVariables>
  <!-- variable index="1" -->
  <ScalarVariable name="Controller.maxlevel" valueReference="0" variability="fixed" causality="parameter" initial="exact"><Real start="2.0"/></ScalarVariable>
  <ScalarVariable name="valvecontrol" valueReference="1" variability="continuous" causality="input"><Real start="0.0"/></ScalarVariable>
  <ScalarVariable name="level" valueReference="2" variability="continuous" causality="output" initial="calculated"><Real unit="m"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="3"/></Outputs><InitialUnknowns><Unknown index="3"/></InitialUnknowns></ModelStructure>""")

OVERTURE = description(
    """modelName="Controller" guid="{8c4e810f-3df3-4a00-8276-176fa3c9f000}" author="" version="" copyright="" license=""
    generationTool="Overture VDM C code generator" generationDateAndTime="2019-02-19T08:21:23Z" variableNamingConvention="flat" """,
    """<CoSimulation modelIdentifier="Controller" needsExecutionTool="true" canHandleVariableCommunicationStepSize="true"
    canBeInstantiatedOnlyOncePerProcess="true" maxOutputDerivativeOrder="0" canGetAndSetFMUstate="false" providesDirectionalDerivative="false"/>
  <LogCategories><Category name="logAll"/><Category name="VdmOut"/></LogCategories>
  <ModelVariables>
  <ScalarVariable name="minlevel" valueReference="1" causality="parameter" variability="fixed" initial="exact"><Real start="1.0" /></ScalarVariable>
  <ScalarVariable name="level" valueReference="2" causality="input" variability="continuous"><Real start="0.0" /></ScalarVariable>
  <ScalarVariable name="valve" valueReference="3" causality="output" variability="discrete" initial="calculated"><Boolean /></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="3" dependencies="2"/></Outputs><InitialUnknowns><Unknown index="3"/></InitialUnknowns></ModelStructure>""")

PYTHONFMU = description(
    """modelName="Slave" guid="a2b1c0d9-0000-11ee-be56-0242ac120002" generationTool="PythonFMU 0.7.0"
    generationDateAndTime="2024-05-01T10:00:00+00:00" variableNamingConvention="structured" """,
    """<CoSimulation needsExecutionTool="true" canHandleVariableCommunicationStepSize="true" canInterpolateInputs="false"
    canBeInstantiatedOnlyOncePerProcess="false" canGetAndSetFMUstate="false" canSerializeFMUstate="false"
    canNotUseMemoryManagementFunctions="true" modelIdentifier="Slave"/>
  <LogCategories><Category name="logStatusWarning" description="Log messages with fmi2Warning status."/></LogCategories>
  <ModelVariables><ScalarVariable name="u" valueReference="0" causality="input" variability="continuous"><Real start="0.0"/></ScalarVariable>
  <ScalarVariable name="y" valueReference="1" causality="output" variability="continuous"><Real/></ScalarVariable></ModelVariables>
  <ModelStructure><Outputs><Unknown index="2"/></Outputs></ModelStructure>""")

# description, files beside it, and every finding that it has
UNITS = {
    "Dymola": (DYMOLA, ["sources/all.c"], {"display-unit-defined": "note", "asynchronous": "note"}),
    "OpenModelica": (OPENMODELICA, ["sources/Chain.c", "sources/util/base_array.c", "sources/gc/alloc.c"], {}),
    "JModelica": (JMODELICA, ["sources/Pendulum.c"], {"generation-date": "note", "unit-base": "note"}),
    "20-sim": (TWENTY_SIM, ["sources/EulerAngles.c", "sources/fmi2Functions.c", "resources/"], {}),
    # the library has a name of its own: 2.3 demands the modelIdentifier's
    "Overture": (OVERTURE, ["binaries/darwin64/Controller.dylib", "binaries/win64/Other.dll", "resources/"],
                 {"execution-tool": "note", "once-per-process": "note", "binary-name": "error", "binary-format": "error"}),
    # 2.2.8 demands InitialUnknowns
    "PythonFMU": (PYTHONFMU, ["sources/slave.c"],
                  {"execution-tool": "note", "generation-date": "note", "initial-unknowns": "error"}),
}


@pytest.mark.parametrize("tool", UNITS)
def test_issue_units_of_other_tools_have_the_findings_of_the_standard(tool, tmp_path):
    text, names, expected = UNITS[tool]
    files = {name: "" for name in [*names, "documentation/index.html"]}
    found = cases.findings(cases.pack(tmp_path / "unit.fmu", text, files))
    assert {it["rule"]: it["severity"] for it in found} == {"platform": "warning", **expected}, found
    assert len(found) == 1 + len(expected), found
