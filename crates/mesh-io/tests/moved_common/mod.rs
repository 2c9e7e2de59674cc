//! Similarities and vectors for tests of meshes that move as a whole.
#![allow(dead_code, missing_docs, unreachable_pub)] // each test binary uses its own part

use mesh::{Similarity, Vec3};
use proptest::prelude::*;

/// Turned, scaled, moved, and mirrored or not.
pub fn similarities() -> impl Strategy<Value = Similarity> {
    let quaternion =
        prop::array::uniform4(-1.0..1.0).prop_filter("not zero", |q| q.iter().any(|x: &f64| x.abs() > 0.1));
    let rest = (0.05..20.0, prop::array::uniform3(-10.0..10.0), any::<bool>());
    (quaternion, rest).prop_map(|(q, (scale, translation, mirrors))| {
        let mut rotation = Similarity::from_quaternion(q).rotation;
        if mirrors {
            rotation[1] = rotation[1].map(|x: f64| -x);
        }
        Similarity {
            scale,
            rotation,
            translation,
        }
    })
}

pub fn turned(by: &Similarity, v: [f64; 3]) -> [f64; 3] {
    by.rotation.map(|row| Vec3(row).dot(Vec3(v)))
}

#[track_caller]
pub fn assert_near(held: [f64; 3], wanted: [f64; 3], tolerance: f64) {
    let apart = (Vec3(held) - Vec3(wanted)).norm();
    assert!(apart <= tolerance, "{held:?} for {wanted:?}");
}
