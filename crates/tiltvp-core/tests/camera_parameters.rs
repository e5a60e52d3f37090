//! Parameters of cameras: every lens declares them once, and refuses what does not fit its declaration.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;

use nalgebra::Vector2;
use tiltvp_core::camera::{Camera, Kind, LARGEST_SIDE_PX, Model, Parameter};
use tiltvp_core::testing::zoo;

type Named = Vec<(String, Parameter)>;

/// A camera of the zoo for each model, as named parameters.
fn examples() -> Vec<(&'static str, Named)> {
    let zoo = zoo();
    let example = |name| {
        let (_, camera) = zoo.iter().find(|(_, camera)| camera.model().name() == name).unwrap();
        camera.model().parameters().into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
    };
    Model::names().map(|name| (name, example(name))).collect()
}

fn message(model: &str, parameters: &Named) -> String {
    Model::from_parameters(model, 1024, 512, parameters).map_or_else(|error| error.to_string(), |_| String::new())
}

fn named(parameters: &[(&str, f64)]) -> Named {
    parameters.iter().map(|&(name, value)| (name.to_owned(), Parameter::Scalar(value))).collect()
}

#[test]
fn the_zoo_has_every_model() {
    let kept: BTreeSet<_> = zoo().iter().map(|(_, camera)| camera.model().name()).collect();
    assert_eq!(kept, Model::names().collect());
}

#[test]
fn every_model_fills_in_what_may_be_left_away() {
    for (model, given) in examples() {
        let schema = Model::schema_of(model).unwrap();
        let needed: Named = given
            .iter()
            .zip(schema.parameters)
            .filter(|(_, one)| one.kind.is_required())
            .map(|(x, _)| x.clone())
            .collect();
        let made = Model::from_parameters(model, 1024, 512, &needed).unwrap();
        for (one, (name, value)) in schema.parameters.iter().zip(made.parameters()) {
            assert_eq!(name, one.name);
            match one.kind {
                Kind::Optional(default) => assert_eq!(value, Parameter::Scalar(default), "{model} {name}"),
                Kind::OptionalList => assert_eq!(value, Parameter::List(Vec::new()), "{model} {name}"),
                Kind::Required | Kind::RequiredList => assert!(needed.contains(&(name.to_owned(), value))),
            }
        }
    }
}

#[test]
fn every_parameter_is_refused_where_it_is_missing_double_of_the_other_kind_or_no_number() {
    for (model, given) in examples() {
        for (i, one) in Model::schema_of(model).unwrap().parameters.iter().enumerate() {
            let with = |value: Parameter| {
                let mut changed = given.clone();
                changed[i].1 = value;
                message(model, &changed)
            };
            let start = format!("camera model {model}: {} = ", one.name);
            let mut without = given.clone();
            let twice = [&given[..], &given[i..=i]].concat();
            without.remove(i);
            let sentence = message(model, &without);
            assert_eq!(sentence.starts_with(&format!("{start}missing")), one.kind.is_required(), "{sentence}");
            assert!(message(model, &twice).starts_with(&format!("{start}given twice")));
            let in_kind = |x: f64| if one.kind.is_list() { Parameter::List(vec![x]) } else { Parameter::Scalar(x) };
            let other = if one.kind.is_list() { Parameter::Scalar(1.0) } else { Parameter::List(vec![1.0]) };
            for wrong in [other, in_kind(f64::NAN), in_kind(f64::INFINITY), in_kind(1e16)] {
                let sentence = with(wrong);
                assert!(sentence.starts_with(&start) && sentence.contains("expected"), "{start} {sentence}");
            }
        }
        let stranger = [&given[..], &named(&[("strange", 1.0)])].concat();
        assert!(message(model, &stranger).contains("parameter = \"strange\", expected one of: "));
    }
}

#[test]
fn every_model_refuses_an_impossible_size() {
    for (model, given) in examples() {
        let made = |width, height| {
            Model::from_parameters(model, width, height, &given).and_then(|lens| Camera::new(width, height, lens))
        };
        assert!(made(LARGEST_SIDE_PX, 1).is_ok());
        for (width, height) in [(0, 480), (640, 0), (LARGEST_SIDE_PX + 1, 480), (640, LARGEST_SIDE_PX + 1)] {
            assert!(made(width, height).is_err(), "{model} {width} {height}");
        }
    }
}

#[test]
fn unknown_names_are_answered_with_near_ones() {
    let text = message("kanala-brandt", &Vec::new());
    assert!(text.contains("did you mean kannala_brandt?") && text.contains("equirectangular"), "{text}");
    let text = message("pinhole", &named(&[("fx", 1.0), ("fy", 1.0), ("cx", 1.0), ("cy", 1.0), ("kk1", 0.1)]));
    assert!(text.contains("did you mean k1?") && text.contains("fx, fy, cx, cy"), "{text}");
    let text = message("pinhole", &named(&[("fx", -1.0), ("fy", 1.0), ("cx", 1.0), ("cy", 1.0)]));
    assert!(text.contains("fx = -1, expected a positive finite number"), "{text}");
}

/// What no image is: of a lens whose pixels are as wide as the world, or of one whose axis is beyond where pixels can be told apart.
#[test]
fn lenses_without_a_scale_or_too_far_away_are_refused() {
    for (model, name, value, expected) in [
        ("equidistant", "focal_px", 7e-10, "a number from 1e-5 on"),
        ("pinhole", "fx", 7e-10, "a number from 1e-5 on"),
        ("extended_unified", "fy", 9.9e-6, "a number from 1e-5 on"),
        ("unified", "cx", -1.1e9, "pixels from -1e9 to 1e9"),
        ("equidistant", "cy", 1e15, "pixels from -1e9 to 1e9"),
    ] {
        let (_, mut given) = examples().into_iter().find(|(known, _)| *known == model).unwrap();
        given.iter_mut().filter(|(known, _)| known == name).for_each(|(_, x)| *x = Parameter::Scalar(value));
        let text = message(model, &given);
        assert!(text.contains(&format!("{name} = {value}, expected {expected}")), "{text}");
    }
}

/// Where distortion goes to infinity, or rises by high powers, pixels beyond those of any image have no ray, and all others come back.
#[test]
fn pixels_that_distortion_carries_beyond_all_images_have_no_ray() {
    let unified = named(&[("xi", 0.91), ("fx", 520.0), ("fy", 521.04), ("cx", 632.7), ("cy", 487.5), ("k1", -0.12)]);
    let unified = [unified, named(&[("k2", 0.02), ("p1", 6e-4), ("p2", -4e-4)])].concat();
    let pole = named(&[("fx", 458.0), ("fy", 457.0), ("cx", 367.2), ("cy", 248.4), ("k1", 0.0), ("k2", 0.0)]);
    let pole = [pole, named(&[("p1", 0.0), ("p2", 0.0), ("k4", -1.484)])].concat();
    for (model, given) in [("unified", unified), ("pinhole", pole)] {
        let lens = Model::from_parameters(model, 1280, 960, &given).unwrap();
        let camera = Camera::new(1280, 960, lens).unwrap();
        for far in [1e2, 1e4, 1e6, 1e8, 1e10, 1e26, 1e111] {
            let pixel = Vector2::new(-far, 380.0);
            let Some(bearing) = camera.unproject(&pixel) else { continue };
            let (back, jacobian) = camera.project_jacobian(&bearing).unwrap();
            assert!((back - pixel).amax() <= 1e-6 * far + 1e-12 * jacobian.norm(), "{model} {far:e} {back}");
            assert!(far < 1e10, "{model} {far:e}");
        }
    }
}

/// Numbers of a polynomial so far apart that no float holds it within its own disc: the tables of its inverse had none either.
#[test]
fn a_polynomial_beyond_the_floats_is_refused() {
    let mut polynomial = vec![-9.947_203_784_237_43e-22, -1_706.172_274_357_213_6];
    polynomial.extend([0.0; 7]);
    polynomial.extend([0.999_176_012_817_578_4, -8.941_715_664_017_115e-108, 2.130_274_465e-314]);
    let mut parameters = named(&[("cx", 456.3), ("cy", 382.8), ("d", -6.25e-4), ("e", 4.31e-4), ("c", 1.000_65)]);
    parameters.push(("polynomial".to_owned(), Parameter::List(polynomial)));
    let refusal = message("ocam", &parameters);
    assert!(refusal.contains("polynomial") && refusal.contains("rays that leave the axis"), "{refusal}");
}
