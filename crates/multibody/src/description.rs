//! The vehicle file: bodies, joints, force elements, magnets as data (JSON).
//!
//! All places are given in the world frame in the initial pose: x forward, y left, z up, in m. A
//! body's position is its centre of mass. The name `ground` is the frame that travels at the
//! vehicle's nominal speed. The frame is inertial, so only the position along the track depends on
//! that speed.

#[cfg(feature = "schema")]
use schemars::JsonSchema;
use serde::de::{IntoDeserializer as _, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use crate::contact::ContactDescription;
use crate::error::Error;

/// Name of the body that does not move.
pub const GROUND: &str = "ground";

/// A whole vehicle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct VehicleDescription {
    /// Path or URL of the schema, for editors. Default: none.
    #[serde(rename = "$schema", default, skip_serializing_if = "Option::is_none")]
    pub schema: Option<String>,
    /// Short name, for example `two-car`.
    pub name: String,
    /// Description of the vehicle, for its users. Default: empty.
    #[serde(default)]
    pub description: String,
    /// Acceleration of gravity (m/s²), for example `[0, 0, -9.81]`.
    pub gravity: [f64; 3],
    /// Nominal air gap c0 (m): the gap of a magnet in its initial place under a track at z = 0.
    pub nominal_gap: f64,
    /// Rigid bodies; at least one.
    pub bodies: Vec<Body>,
    /// Joints between two bodies, or a body and the ground. Default: none.
    #[serde(default)]
    pub joints: Vec<Joint>,
    /// Bushings (air springs, traction rods, elastic joints). Default: none.
    #[serde(default)]
    pub bushings: Vec<Bushing>,
    /// Springs between two points. Default: none.
    #[serde(default)]
    pub springs: Vec<Spring>,
    /// Spring-dampers in the free coordinate of translational and revolute joints. Default: none.
    #[serde(default)]
    pub joint_forces: Vec<JointForce>,
    /// What holds the speed. Default: nothing.
    #[serde(default)]
    pub drive: Option<Drive>,
    /// Electromagnets, in the order of the signals. Default: none.
    #[serde(default)]
    pub magnets: Vec<MagnetPoint>,
    /// Bodies whose motion is an output. Default: none.
    #[serde(default)]
    pub observed: Vec<Observed>,
    /// Mechanical stops and landing skids at the magnets. Default: the standard ones, switched off.
    #[serde(default)]
    pub contact: Option<ContactDescription>,
    /// Elements whose stiffness and damping are parameters of the vehicle unit, group by group. Default:
    /// none.
    #[serde(default)]
    pub groups: Vec<ElementGroup>,
}

/// A rigid body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Name, unique among the bodies.
    pub name: String,
    /// Mass (kg).
    pub mass: f64,
    /// Inertia about the centre of mass in the body's own axes (kg·m²).
    pub inertia: Inertia,
    /// Centre of mass (m).
    pub position: [f64; 3],
    /// Attitude as a unit quaternion (w, x, y, z). Default: the axes of the world.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orientation: Option<[f64; 4]>,
    /// True for a body that represents the surroundings. Its mass does not count as mass of the
    /// vehicle. Default: false.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub reference: bool,
}

/// Inertia: three principal moments, or the full symmetric matrix by rows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(
    untagged,
    expecting = "expected three principal moments [x, y, z], or a symmetric matrix as three rows of \
                 three numbers, kg·m²"
)]
pub enum Inertia {
    /// Moments about the body's x, y and z axes.
    Principal([f64; 3]),
    /// The full matrix.
    Full([[f64; 3]; 3]),
}

/// Kinds of joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum JointKind {
    /// Fixes b to a: 6 equations, eliminated before the simulation.
    Bracket,
    /// b slides along the axis: 5 equations.
    Translational,
    /// Common point: 3 equations.
    Spherical,
    /// b turns about the axis: 5 equations.
    Revolute,
}

impl JointKind {
    /// Number of constraint equations.
    #[must_use]
    pub fn equations(self) -> usize {
        match self {
            Self::Bracket => 6,
            Self::Translational | Self::Revolute => 5,
            Self::Spherical => 3,
        }
    }

    /// True where an axis must be given.
    #[must_use]
    pub fn has_axis(self) -> bool {
        matches!(self, Self::Translational | Self::Revolute)
    }
}

impl std::fmt::Display for JointKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Bracket => "bracket",
            Self::Translational => "translational",
            Self::Spherical => "spherical",
            Self::Revolute => "revolute",
        })
    }
}

/// A joint between two bodies (or a body and `ground`).
///
/// Its place is one world point (`position`, with `axis`), or one point on either body in that
/// body's own coordinates (`local_a` and `local_b`, with `local_axis_a` and `local_axis_b`), which
/// must then meet in the initial pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Joint {
    /// Name, unique among the joints.
    pub name: String,
    /// Kind of joint, which determines its equations.
    #[serde(deserialize_with = "word")]
    pub kind: JointKind,
    /// Body a: carries the axis.
    pub body_a: String,
    /// Body b: moves relative to a.
    pub body_b: String,
    /// The joint's point in the world (m). Default: `local_a` and `local_b` give it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<[f64; 3]>,
    /// The joint's axis in the world (any length). Default: the local axes give it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<[f64; 3]>,
    /// The joint's point on a, from a's centre of mass in a's axes (m). Default: `position` gives it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub local_a: Option<[f64; 3]>,
    /// The joint's point on b, from b's centre of mass in b's axes (m). Default: `position` gives it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub local_b: Option<[f64; 3]>,
    /// The joint's axis in a's axes (any length). Default: `axis` gives it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub local_axis_a: Option<[f64; 3]>,
    /// The joint's axis in b's axes (any length). Default: `axis` gives it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub local_axis_b: Option<[f64; 3]>,
}

/// Three translational and three rotational spring-dampers between two bodies, along axes that are
/// fixed to a. Unloaded (up to the preload) in the initial pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Bushing {
    /// Name, unique among the bushings.
    pub name: String,
    /// Body that carries the frame.
    pub body_a: String,
    /// Body that carries the point at which the force pair acts.
    pub body_b: String,
    /// Place of both ends (m).
    pub position: [f64; 3],
    /// Attitude of the bushing's axes (w, x, y, z). Default: the axes of the world in the initial
    /// pose.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orientation: Option<[f64; 4]>,
    /// Stiffness along the three axes (N/m). Default: zeros.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub translational_stiffness: [f64; 3],
    /// Damping along the three axes (N·s/m). Default: zeros.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub translational_damping: [f64; 3],
    /// Stiffness about the three axes (N·m/rad). Default: zeros.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub rotational_stiffness: [f64; 3],
    /// Damping about the three axes (N·m·s/rad). Default: zeros.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub rotational_damping: [f64; 3],
    /// Force on a in the initial pose, along the bushing's axes (N). Default: zeros.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub preload: [f64; 3],
}

/// A spring-damper on the line between two points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Spring {
    /// Name, unique among the springs.
    pub name: String,
    /// Body at end a.
    pub body_a: String,
    /// End a (m).
    pub position_a: [f64; 3],
    /// Body at end b.
    pub body_b: String,
    /// End b (m).
    pub position_b: [f64; 3],
    /// Stiffness (N/m).
    pub stiffness: f64,
    /// Damping (N·s/m). Default: 0.
    #[serde(default)]
    pub damping: f64,
    /// Length at which the spring exerts no force (m). Default: the initial length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub free_length: Option<f64>,
}

/// Spring-damper and constant force in the free coordinate of a joint: the displacement along the
/// axis (translational, m) or the angle about it (revolute, rad), both zero in the initial pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct JointForce {
    /// Name of a translational or revolute joint.
    pub joint: String,
    /// Stiffness (N/m, or N·m/rad for a revolute joint).
    pub stiffness: f64,
    /// Damping (N·s/m, or N·m·s/rad for a revolute joint). Default: 0.
    #[serde(default)]
    pub damping: f64,
    /// Constant force along (moment about) the axis, positive on b (N or N·m): a drive. Default: 0.
    #[serde(default, skip_serializing_if = "is_nought")]
    pub preload: f64,
}

/// Holds bodies at their place along the track, which travels with the nominal speed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Drive {
    /// The bodies that are driven, each by a longitudinal force at its centre of mass.
    pub bodies: Vec<String>,
    /// Stiffness relative to the nominal position along the track (N/m).
    pub stiffness: f64,
    /// Damping relative to the nominal speed (N·s/m).
    pub damping: f64,
}

/// An electromagnet: a point that takes a vertical and a lateral force.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct MagnetPoint {
    /// The body that carries it.
    pub body: String,
    /// Point of the forces (m).
    pub position: [f64; 3],
}

/// A body whose motion is observed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Observed {
    /// Prefix of the outputs, for example `car_1`: lower-case letters, digits, underscores.
    pub name: String,
    /// Name of the observed body.
    pub body: String,
    /// Further points whose accelerations are outputs (ride comfort; m). Default: none.
    #[serde(default)]
    pub points: Vec<[f64; 3]>,
    /// The body that carries each point. Default: the observed body carries all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub point_bodies: Vec<String>,
    /// Bodies that belong to the observed one, such as the other segments of a car body that bends. Its mass
    /// as a parameter includes theirs, and a load is carried by the nearest of them. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<String>,
    /// Names of the bushings that level this body, with `*` for any letters: air springs with levelling valves.
    /// Their preload follows if parameters change what they carry. Their end b is on this body's side. Default:
    /// none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub levelled_by: Vec<String>,
}

/// Elements of one kind that have a stiffness and a damping in common.
///
/// The vehicle unit has parameters for them, such as `air_spring_vertical_stiffness` in N/m; factors
/// (`…_factor`) where the values differ within the group. In the lists `*` stands for any letters and `[1..4]`
/// for numbers; one of the lists is given.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ElementGroup {
    /// Beginning of the parameters' names: lower-case letters, digits, underscores.
    pub name: String,
    /// Names of bushings. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bushings: Vec<String>,
    /// Names of springs. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub springs: Vec<String>,
    /// Names of the joints whose forces belong to the group. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joint_forces: Vec<String>,
}

impl VehicleDescription {
    /// Reads a description and checks it. With the key `train` it is a [`TrainDescription`], and the other
    /// keys change the train's bodies, joints and elements by their names.
    ///
    /// [`TrainDescription`]: crate::train::TrainDescription
    ///
    /// # Errors
    /// [`Error::Read`] or [`Error::Invalid`], with the JSON path of the place.
    pub fn from_json(text: &str) -> Result<Self, Error> {
        crate::file::read(text)
    }

    /// The description as JSON, one line per body, joint or element, with a final newline.
    ///
    /// # Errors
    /// [`Error::Invalid`] where a number has no JSON form (NaN, infinity).
    pub fn to_json(&self) -> Result<String, Error> {
        let mut fields = Vec::new();
        if let Some(schema) = &self.schema {
            fields.push(format!("\"$schema\": {}", json(schema)?));
        }
        fields.extend([
            format!("\"name\": {}", json(&self.name)?),
            format!("\"description\": {}", json(&self.description)?),
            format!("\"gravity\": {}", json(&self.gravity)?),
            format!("\"nominal_gap\": {}", json(&self.nominal_gap)?),
            list("bodies", &self.bodies)?,
            list("joints", &self.joints)?,
            list("bushings", &self.bushings)?,
            list("springs", &self.springs)?,
            list("joint_forces", &self.joint_forces)?,
            format!("\"drive\": {}", json(&self.drive)?),
            list("magnets", &self.magnets)?,
            list("observed", &self.observed)?,
            list("groups", &self.groups)?,
        ]);
        if let Some(contact) = &self.contact {
            fields.push(format!("\"contact\": {}", json(contact)?));
        }
        Ok(format!("{{\n  {}\n}}\n", fields.join(",\n  ")))
    }
}

/// A kind of joint as a word: serde_json would also take an object with the word as its key.
fn word<'de, D: Deserializer<'de>>(deserializer: D) -> Result<JointKind, D::Error> {
    struct Word;
    impl Visitor<'_> for Word {
        type Value = JointKind;

        fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.write_str("a text")
        }

        fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<JointKind, E> {
            JointKind::deserialize(word.into_deserializer())
        }
    }
    deserializer.deserialize_str(Word)
}

/// True for a vector that the file may leave out.
// the signature is serde's
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_nought(v: &f64) -> bool {
    *v == 0.0
}

fn is_zero(v: &[f64; 3]) -> bool {
    *v == [0.0; 3]
}

fn json<T: Serialize>(value: &T) -> Result<String, Error> {
    serde_json::to_string(value)
        .map_err(|e| Error::Invalid { path: "$".to_owned(), message: e.to_string() })
}

fn list<T: Serialize>(key: &str, items: &[T]) -> Result<String, Error> {
    if items.is_empty() {
        return Ok(format!("\"{key}\": []"));
    }
    let lines = items.iter().map(json).collect::<Result<Vec<_>, _>>()?;
    Ok(format!("\"{key}\": [\n    {}\n  ]", lines.join(",\n    ")))
}
