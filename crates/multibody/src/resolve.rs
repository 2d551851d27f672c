//! Elements, magnets and observed points of a description, placed on the composite bodies.

use std::fmt::Display;

use crate::anchor::{Anchor, DriveForce, WatchedBody};
use crate::composite::Merged;
use crate::description::VehicleDescription;
use crate::elements::{BushingElement, Rotation, SpringElement, Translation};
use crate::error::Error;
use crate::math::{Mat3, Vec3, conjugate, multiply, rotation_matrix};
use crate::names::BodyNames;

/// Looks bodies up by name and places points on the composites.
pub(crate) struct Anchors<'a> {
    pub merged: &'a Merged,
    pub names: &'a BodyNames<'a>,
}

impl Anchors<'_> {
    fn anchor(&self, body: &str, point: [f64; 3], path: &dyn Display) -> Result<Anchor, Error> {
        let composite = self.merged.composite(Some(self.names.moving(body, path)?));
        let start = Vec3::from(point);
        Ok(Anchor { body: composite, local: self.merged.localise(composite, &start), start })
    }

    /// As `anchor`, on a body that is not fixed to the ground.
    fn movable(&self, body: &str, point: [f64; 3], path: &dyn Display) -> Result<Anchor, Error> {
        let anchor = self.anchor(body, point, path)?;
        if anchor.body.0 == self.merged.composites.len() {
            return Err(Error::Invalid {
                path: path.to_string(),
                message: format!("`{body}` is fixed to the ground, so a force there has no effect"),
            });
        }
        Ok(anchor)
    }

    pub fn bushings(&self, description: &VehicleDescription) -> Result<Vec<BushingElement>, Error> {
        description
            .bushings
            .iter()
            .enumerate()
            .map(|(k, data)| {
                let path = format_args!("bushings[{k}]");
                let (a, b) = self.names.pair(&data.body_a, &data.body_b, &path)?;
                let (a, b) = (self.merged.composite(a), self.merged.composite(b));
                let point = Vec3::from(data.position);
                let world = data
                    .orientation
                    .map_or(Mat3::identity(), |q| rotation_matrix(crate::math::normalised(q)));
                let (pa, pb) = (self.merged.attitude(a), self.merged.attitude(b));
                let axes = rotation_matrix(pa).tr_mul(&world);
                let relative = multiply(conjugate(pa), pb);
                let translation = Translation {
                    point_a: self.merged.localise(a, &point),
                    point_b: self.merged.localise(b, &point),
                    stiffness: data.translational_stiffness.into(),
                    damping: data.translational_damping.into(),
                    preload: data.preload.into(),
                };
                let rotation = Rotation {
                    stiffness: data.rotational_stiffness.into(),
                    damping: data.rotational_damping.into(),
                    untwist: (relative != crate::math::IDENTITY)
                        .then(|| Box::new(conjugate(relative))),
                };
                let acts = |values: &[Vec3]| values.iter().any(|v| *v != Vec3::zeros());
                let translates =
                    acts(&[translation.stiffness, translation.damping, translation.preload]);
                let rotates = acts(&[rotation.stiffness, rotation.damping]);
                Ok(BushingElement {
                    a,
                    b,
                    axes: (axes != Mat3::identity()).then(|| Box::new(axes)),
                    translation: translates.then(|| Box::new(translation)),
                    rotation: rotates.then(|| Box::new(rotation)),
                })
            })
            .collect()
    }

    pub fn springs(&self, description: &VehicleDescription) -> Result<Vec<SpringElement>, Error> {
        description
            .springs
            .iter()
            .enumerate()
            .map(|(k, data)| {
                let (a, b) =
                    self.names.pair(&data.body_a, &data.body_b, &format_args!("springs[{k}]"))?;
                let (a, b) = (self.merged.composite(a), self.merged.composite(b));
                let (pa, pb) = (Vec3::from(data.position_a), Vec3::from(data.position_b));
                Ok(SpringElement {
                    a,
                    b,
                    point_a: self.merged.localise(a, &pa),
                    point_b: self.merged.localise(b, &pb),
                    stiffness: data.stiffness,
                    damping: data.damping,
                    free_length: data.free_length.unwrap_or_else(|| (pb - pa).norm()),
                })
            })
            .collect()
    }

    pub fn drive(&self, description: &VehicleDescription) -> Result<Option<DriveForce>, Error> {
        let Some(data) = &description.drive else { return Ok(None) };
        let anchors = data
            .bodies
            .iter()
            .enumerate()
            .map(|(k, name)| {
                let path = format_args!("drive.bodies[{k}]");
                let body = self.names.moving(name, &path)?;
                self.movable(name, description.bodies[body].position, &path)
            })
            .collect::<Result<_, _>>()?;
        Ok(Some(DriveForce { anchors, stiffness: data.stiffness, damping: data.damping }))
    }

    pub fn magnets(&self, description: &VehicleDescription) -> Result<Vec<Anchor>, Error> {
        description
            .magnets
            .iter()
            .enumerate()
            .map(|(k, m)| self.movable(&m.body, m.position, &format_args!("magnets[{k}].body")))
            .collect()
    }

    pub fn watched(&self, description: &VehicleDescription) -> Result<Vec<WatchedBody>, Error> {
        description
            .observed
            .iter()
            .enumerate()
            .map(|(k, data)| {
                let path = format_args!("observed[{k}].body");
                let carrier = |i: usize| data.point_bodies.get(i).unwrap_or(&data.body);
                let points = data
                    .points
                    .iter()
                    .enumerate()
                    .map(|(i, p)| self.anchor(carrier(i), *p, &path))
                    .collect::<Result<_, _>>()?;
                let member = self.names.moving(&data.body, &path)?;
                Ok(WatchedBody { name: data.name.clone(), member, points })
            })
            .collect()
    }
}
