//! The line against closed forms and differences.
#![allow(clippy::unwrap_used, reason = "a test program")]

use nalgebra::Vector3;
use track_line::{Frame, Line, LineDescription};

fn line(text: &str) -> Line {
    Line::new(&LineDescription::from_json(text).unwrap()).unwrap()
}

/// Straight, clothoid, circle of 50 m, clothoid, with cant, a sag and a crest, all overlapping.
fn twisted() -> Line {
    line(
        r#"{ "name": "twisted", "start": 10, "plan": [
            { "kind": "straight", "length": 20 }, { "kind": "clothoid", "length": 25, "to_radius": 50 },
            { "kind": "circle", "length": 40, "radius": 50 }, { "kind": "clothoid", "length": 50, "to_radius": -80 },
            { "kind": "clothoid", "length": 25 } ],
          "elevation": [
            { "kind": "straight", "length": 30 }, { "kind": "clothoid", "length": 20, "to_radius": 300 },
            { "kind": "clothoid", "length": 20 }, { "kind": "straight", "length": 13 },
            { "kind": "clothoid", "length": 25, "to_radius": -300 }, { "kind": "clothoid", "length": 15 } ],
          "cant": [
            { "length": 20 }, { "length": 25, "to": -0.08 }, { "length": 40 }, { "length": 50, "to": 0.05 },
            { "length": 25, "to": 0, "shape": "linear" } ] }"#,
    )
}

#[test]
fn analytic_a_circle_is_a_circle() {
    let line = line(
        r#"{ "name": "c", "plan": [ { "kind": "clothoid", "length": 30, "to_radius": 200 },
            { "kind": "circle", "length": 5000, "radius": 200 }, { "kind": "clothoid", "length": 30 } ] }"#,
    );
    let begin = line.frame(30.0);
    let centre = begin.position + begin.axes.column(1) * 200.0;
    for s in [30.0, 100.5, 4321.0, 5030.0] {
        let frame = line.frame(s);
        // 5000 cells, each rounded to 3e-14 m
        assert!((frame.position + frame.axes.column(1) * 200.0 - centre).norm() < 2e-11, "{s}");
        assert!((frame.curvature - Vector3::new(0.0, 0.0, 1.0 / 200.0)).norm() < 1e-15);
        let angle = (s - 30.0) / 200.0;
        let turned: Vector3<f64> =
            begin.axes.column(0) * f64::cos(angle) + begin.axes.column(1) * f64::sin(angle);
        assert!((frame.axes.column(0) - turned).norm() < 1e-12);
    }
}

/// ∫cos(u²/2A²), ∫sin(u²/2A²) by their power series.
#[test]
fn analytic_a_clothoid_is_fresnels_integral() {
    let line = line(
        r#"{ "name": "c", "plan": [ { "kind": "clothoid", "length": 40, "to_radius": 50 },
            { "kind": "clothoid", "length": 40 } ] }"#,
    );
    let square = 40.0 * 50.0;
    for s in [3.0, 20.0, 40.0] {
        let (mut x, mut y) = (0.0, 0.0);
        let t: f64 = s * s / (2.0 * square);
        let mut term = s;
        for k in 0..30 {
            let value = term / f64::from(2 * k + 1);
            match k % 4 {
                0 => x += value,
                1 => y += value,
                2 => x -= value,
                _ => y -= value,
            }
            term *= t / f64::from(k + 1);
        }
        let frame = line.frame(s);
        assert!((frame.position - Vector3::new(x, y, 0.0)).norm() < 1e-12, "{}", frame.position);
    }
}

fn derivative<T>(f: impl Fn(f64) -> T, at: f64, h: f64) -> T
where
    T: std::ops::Sub<Output = T> + std::ops::Mul<f64, Output = T>,
{
    ((f(at + h) - f(at - h)) * 8.0 - (f(at + 2.0 * h) - f(at - 2.0 * h))) * (1.0 / (12.0 * h))
}

/// dp/ds = t, dR/ds = R·[κ]ₓ and dκ/ds, by differences of fourth order; no jump at a cell's end.
#[test]
fn analytic_frames_follow_each_other() {
    let line = twisted();
    let h = 1e-3;
    for k in 0..170 {
        // away from the pieces' ends, where the curvature has kinks
        let s = 5.3 + f64::from(k);
        let frame = line.frame(s);
        let orthogonal = frame.axes.transpose() * frame.axes - nalgebra::Matrix3::identity();
        assert!(orthogonal.norm() < 1e-14 && frame.axes.determinant() > 0.0);
        let tangent = derivative(|s| line.frame(s).position, s, h);
        assert!((tangent - frame.axes.column(0)).norm() < 1e-10, "{s}");
        let turning = derivative(|s| line.frame(s).axes, s, h);
        let turned = frame.axes * frame.curvature.cross_matrix();
        assert!((turning - turned).norm() < 1e-10, "{s}: {}", turning - turned);
        let bend = derivative(|s| line.frame(s).curvature, s, h);
        assert!((bend - frame.curvature_rate).norm() < 1e-9, "{s}");
    }
    let [start, end] = line.extent();
    assert_eq!(start, 10.0);
    for k in 0..1500 {
        let s = start + 0.1 * f64::from(k);
        if s > end {
            break;
        }
        let jump = line.frame(s - 1e-9).position + line.frame(s).axes.column(0) * 1e-9;
        assert!((jump - line.frame(s).position).norm() < 1e-13);
    }
}

/// A point that moves along a known course beside the line: coordinates, rates and accelerations.
#[test]
fn analytic_points_meet_the_line() {
    let line = twisted();
    let origin = line.frame(60.0);
    for s in [22.7, 61.1, 75.4, 101.9, 140.2] {
        let course = |t: f64| {
            let foot = line.frame(s + 7.0 * t - 2.0 * t * t);
            let across = Vector3::new(0.0, 0.9 + 0.4 * t - t * t, -1.1 + 0.3 * t + 2.0 * t * t);
            let point = foot.position + foot.axes * across;
            (origin.axes.tr_mul(&(point - origin.position)), across)
        };
        let place = |t: f64| line.meet(&origin, &course(t).0, s + 0.4).unwrap();
        let meeting = place(0.0);
        assert!((meeting.frame.s - s).abs() < 1e-12, "{}", meeting.frame.s - s);
        assert!((meeting.across - course(0.0).1).norm() < 1e-12);
        let h = 1e-3;
        let inward = |v: Vector3<f64>| meeting.frame.axes.tr_mul(&(origin.axes * v));
        let velocity = inward(derivative(|t| course(t).0, 0.0, h));
        let acceleration = inward(derivative(|t| derivative(|u| course(t + u).0, 0.0, h), 0.0, h));
        let rates = meeting.rates(&velocity);
        assert!((rates - Vector3::new(7.0, 0.4, 0.3)).norm() < 1e-8, "{rates}");
        let bends = meeting.accelerations(&velocity, &acceleration);
        // a second difference of 60 m over 1e-3 s
        assert!((bends - Vector3::new(-4.0, -2.0, 4.0)).norm() < 1e-6, "{bends}");
    }
    let far = line.meet(&line.frame(70.0), &Vector3::new(0.0, 49.0, 0.0), 70.0).unwrap_err();
    assert!(far.to_string().contains("too far"), "{far}");
}

/// Ten kilometres on, coordinates across the line are as good as at its start.
#[test]
fn invariant_long_lines_keep_their_accuracy() {
    let text = |length: f64| {
        format!(
            r#"{{ "name": "l", "plan": [ {{ "kind": "clothoid", "length": 50, "to_radius": 900 }},
            {{ "kind": "circle", "length": {length}, "radius": 900 }}, {{ "kind": "clothoid", "length": 50 }} ] }}"#
        )
    };
    let line = line(&text(20_000.0));
    let point = Vector3::new(11.7, -0.93, -0.4);
    let at = |s: f64| line.meet(&line.frame(s), &point, s + 11.7).unwrap();
    let (near, far) = (at(100.0), at(19_000.0));
    assert!((near.across - far.across).norm() < 5e-12);
    assert!((near.frame.s - far.frame.s + 18_900.0).abs() < 1e-10);
}

#[test]
fn analytic_outside_the_line_is_straight() {
    let line = twisted();
    let [start, end] = line.extent();
    let before = line.frame(start - 7.0);
    assert_eq!(before.position, Vector3::new(-7.0, 0.0, 0.0));
    let (last, after) = (line.frame(end), line.frame(end + 12.0));
    assert!((after.position - last.position - last.axes.column(0) * 12.0).norm() < 1e-13);
    assert!(
        line.is_plain(-100.0, 29.0) && !line.is_plain(-100.0, 31.0) && !line.is_plain(60.0, 61.0)
    );
    let level = Frame::level();
    assert_eq!(line.meet(&level, &Vector3::new(1.0, 2.0, 3.0), 1.0).unwrap().across.y, 2.0);
}

#[test]
fn refusal_of_lines_that_are_not_continuous() {
    let refused = |plan: &str, rest: &str| {
        let text = format!(r#"{{ "name": "x", "plan": [{plan}]{rest} }}"#);
        LineDescription::from_json(&text).unwrap_err().to_string()
    };
    let straight = r#"{ "kind": "straight", "length": 50 }"#;
    let circle = r#"{ "kind": "circle", "length": 50, "radius": 200 }"#;
    for (plan, rest, reasons) in [
        (
            format!("{straight}, {circle}"),
            "",
            ["`plan[1]`", "jumps from straight to a radius of 200 m at 50 m"],
        ),
        (
            r#"{ "kind": "clothoid", "length": 50, "to_radius": 100 }"#.to_owned(),
            "",
            ["`plan[0]`", "ends with a radius of 100 m"],
        ),
        (
            r#"{ "kind": "clothoid", "length": 50, "radius": 100 }"#.to_owned(),
            "",
            ["`plan[0].radius`", "only circles"],
        ),
        (r#"{ "kind": "straight", "length": 0 }"#.to_owned(), "", ["`plan[0].length`", "above 0"]),
        (
            r#"{ "kind": "circle", "length": 10 }"#.to_owned(),
            "",
            ["`plan[0].radius`", "needs its radius"],
        ),
        (
            r#"{ "kind": "clothoid", "length": 10, "to_radius": 1 }"#.to_owned(),
            "",
            ["to_radius", "at least 5 m"],
        ),
        (r#"{ "kind": "bend", "length": 10 }"#.to_owned(), "", ["plan[0].kind", "bend"]),
        (String::new(), "", ["`plan`", "no piece"]),
        (straight.to_owned(), r#", "cant": [{ "length": 5, "to": 1.0 }]"#, ["`cant[0].to`", "rad"]),
        (straight.to_owned(), r#", "cants": []"#, ["cants", "did you mean"]),
        (straight.to_owned(), r#", "start": 1e999"#, ["start", "out of range"]),
        (
            straight.to_owned(),
            r#", "elevation": [{ "kind": "clothoid", "length": 60, "to_radius": 50 }, { "kind": "clothoid", "length": 60 }]"#,
            ["`elevation[0]`", "slope"],
        ),
    ] {
        let text = refused(&plan, rest);
        assert!(reasons.iter().all(|reason| text.contains(reason)), "{text}");
    }
}
