//! Real environment maps against what OpenEXR and OpenCV read in them (`tests/data/read_environments.py`).

use coshade_image_file::read;

#[test]
fn real_maps_read_as_other_readers_read_them() {
    let test = "real_maps_read_as_other_readers_read_them";
    let Some(folder) = coshade_testdata::find(test, "environment/equirect") else { return };
    let expected = include_str!("data/environments.json");
    let expected: serde_json::Map<String, serde_json::Value> = serde_json::from_str(expected).unwrap();
    assert_eq!(expected.len(), 9);
    for (name, channels) in expected {
        let file = read(folder.join(&name)).unwrap();
        let [layer] = file.layers.as_slice() else { panic!("{name}: {} layers", file.layers.len()) };
        let image = &layer.image;
        let channels = channels.as_object().unwrap();
        assert_eq!(image.channels().len(), channels.len(), "{name}");
        for (channel, figures) in channels {
            let figure = |index: usize| figures[index].as_f64().unwrap();
            let samples = image.channel(channel).unwrap();
            let least = samples.iter().copied().fold(f32::INFINITY, f32::min);
            let largest = samples.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            let mean = samples.iter().map(|&s| f64::from(s)).sum::<f64>() / samples.len() as f64;
            assert_eq!((image.width() as f64, image.height() as f64), (figure(0), figure(1)), "{name}");
            assert_eq!((least, largest), (figure(2) as f32, figure(4) as f32), "{name} {channel}");
            // Sums of a million doubles in another order.
            assert!((mean - figure(3)).abs() <= 1e-9 * figure(3), "{name} {channel}: {mean} {}", figure(3));
        }
    }
}
