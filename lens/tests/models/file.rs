//! A model in a file, and the model of a resized image.

use coshade_lens::model::{CameraModel, ModelKind};
use nalgebra::{Vector2, Vector3};

use crate::lenses;

#[derive(Debug, PartialEq, serde::Serialize, serde::Deserialize)]
struct File {
    lens: CameraModel,
}

#[test]
fn reads_well_in_toml() {
    let text = "[lens]\nmodel = \"kannala_brandt4\"\nfx = 336.25\nfy = 336.0\ncx = 543.0\ncy = 377.5\n\
                k1 = 0.0025\nk2 = -0.0075\nk3 = 0.001\nk4 = -0.0005\n";
    let file: File = toml::from_str(text).unwrap();
    let expected = [336.25, 336.0, 543.0, 377.5, 0.0025, -0.0075, 0.001, -0.0005];
    assert_eq!(file.lens, CameraModel::from_params(ModelKind::KannalaBrandt4, &expected).unwrap());
    assert_eq!(toml::to_string(&file).unwrap(), text);
}

#[test]
fn every_model_survives_a_file_bit_by_bit() {
    for lens in lenses::known() {
        let text = toml::to_string(&File { lens }).unwrap();
        assert!(text.contains(&format!("model = \"{}\"", lens.kind())), "{text}");
        for name in lens.param_names() {
            assert!(text.contains(&format!("\n{name} = ")), "{name} in {text}");
        }
        let back: File = toml::from_str(&text).unwrap();
        assert_eq!(back, File { lens });
        assert_eq!(back.lens.max_angle_rad(), lens.max_angle_rad());
    }
}

#[test]
fn wrong_files_are_refused_by_name() {
    let pinhole = "[lens]\nmodel = \"pinhole\"\nfx = 500.0\nfy = 500.0\ncx = 319.5\n";
    let error = |text: &str| toml::from_str::<File>(text).unwrap_err().to_string();
    assert!(error(pinhole).contains("missing field `cy`"), "{}", error(pinhole));
    let unknown = error(&format!("{pinhole}cy = 239.5\nk1 = 0.1\n"));
    assert!(unknown.contains("k1"), "{unknown}");
    let negative = error(&format!("{}cy = 1.0\n", pinhole.replace("fx = 500.0", "fx = -500.0")));
    assert!(negative.contains("fx = -500"), "{negative}");
    let model = error("[lens]\nmodel = \"fisheye\"\n");
    assert!(model.contains("fisheye") && model.contains("kannala_brandt4"), "{model}");
}

#[test]
fn the_schema_lists_all_models_and_keys() {
    let schema = serde_json::to_string(&schemars::schema_for!(CameraModel)).unwrap();
    for kind in ModelKind::ALL {
        assert!(schema.contains(&format!("\"{}\"", kind.name())), "{schema}");
        assert!(kind.param_names().iter().all(|name| schema.contains(&format!("\"{name}\""))));
    }
}

/// A point keeps its place in the image: in raster coordinates (pixel i covers [i, i+1)) it is scaled by s.
#[test]
fn a_resized_image_has_the_same_rays() {
    let point = Vector3::new(0.2, -0.1, 1.0);
    let half = Vector2::new(0.5, 0.5);
    for lens in lenses::known() {
        let scale = Vector2::new(0.25, 3.0);
        let scaled = lens.scaled(scale).unwrap();
        let expected = (lens.project(&point).unwrap() + half).component_mul(&scale) - half;
        assert!((scaled.project(&point).unwrap() - expected).norm() < 1e-10, "{lens:?}");
        assert_eq!(scaled.max_angle_rad(), lens.max_angle_rad());
        assert!(lens.scaled(Vector2::new(0.0, 1.0)).unwrap_err().to_string().contains("fx"));
    }
}

#[test]
fn names_parse() {
    for kind in ModelKind::ALL {
        assert_eq!(kind.name().parse::<ModelKind>().unwrap(), kind);
        assert!(kind.param_names().len() <= coshade_lens::model::MAX_PARAMS);
    }
}
