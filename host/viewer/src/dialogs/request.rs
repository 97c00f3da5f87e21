//! The title, filter and suggested name of a file dialog.

use super::file_dialog::{Completion, Purpose, Request};
use super::state::DialogPurpose;
use crate::document::file_names::{cloud_file_name, layer_file_name, scene_file_name};
use crate::window::Window;
use std::path::Path;
use surfelshop_cloud::Formats as _;
use surfelshop_session::input::layers;

/// Describes a dialog.
pub(super) fn request(window: &Window, purpose: &DialogPurpose) -> Request {
    let endings = |endings: &[&str]| endings.iter().map(|ending| (*ending).to_owned()).collect();
    let request = |title: &str, filter: &str, of: &[&str], purpose: Purpose| Request {
        title: title.to_owned(),
        filter: filter.to_owned(),
        endings: endings(of),
        purpose,
    };
    let save =
        |name: &str, completed: Completion| Purpose::Save { name: name.to_owned(), completed };
    match purpose {
        DialogPurpose::Open | DialogPurpose::Add => {
            let formats = window.plugins.formats().endings(false);
            let known = ["ply", "obj", "off"].into_iter().chain(formats.iter().map(String::as_str));
            let (title, filter, others) = match purpose {
                DialogPurpose::Add => ("Add clouds", "clouds", &["hdr", "exr"][..]),
                _ => ("Open clouds or a scene", "clouds and scenes", &["toml", "hdr", "exr"][..]),
            };
            let known: Vec<&str> = known.chain(others.iter().copied()).collect();
            request(title, filter, &known, Purpose::OpenSeveral)
        }
        DialogPurpose::SaveScene => {
            let purpose = save("surfelshop.scene.toml", Completion::new(scene_file_name));
            request("Save the scene", "scenes", &["toml"], purpose)
        }
        DialogPurpose::SaveCloud(index) if is_pyramid(window, *index) => {
            let name = suggested_name(window, *index, &["surfels".to_owned()]);
            let stem = name.rsplit_once('.').map_or(&*name, |(stem, _)| stem);
            let name = format!("{stem}.{}", layers::ENDING);
            let completed = Completion::new(layer_file_name);
            request("Save the edits", "layers", &["json"], save(&name, completed))
        }
        DialogPurpose::SaveCloud(index) => {
            let written = window.plugins.formats().endings(true);
            let name = suggested_name(window, *index, &written);
            let known: Vec<&str> =
                std::iter::once("ply").chain(written.iter().map(String::as_str)).collect();
            let endings = written.clone();
            let completed = Completion::new(move |path| cloud_file_name(path, &endings));
            request("Save the cloud", "clouds", &known, save(&name, completed))
        }
        DialogPurpose::Pictures => {
            let purpose = save("surfelshop.png", Completion::new(Path::to_owned));
            request("Save pictures", "pictures", &["png", "exr"], purpose)
        }
        DialogPurpose::Probe => {
            request("Open a light probe", "light probes", &["hdr", "exr"], Purpose::Open)
        }
        DialogPurpose::Reference => {
            let (title, filter) =
                ("Choose a picture to measure against", "pictures of linear radiance");
            request(title, filter, &["exr"], Purpose::Open)
        }
        DialogPurpose::Value { id, endings, .. } => Request {
            title: format!("Choose a file for {id}"),
            filter: endings.join(", "),
            endings: endings.clone(),
            purpose: Purpose::Open,
        },
    }
}

/// A name for an edited cloud, other than the one of its source file: of the same format where that can be written.
/// Whether an open cloud is a pyramid.
fn is_pyramid(window: &Window, index: usize) -> bool {
    let all = window.document.clouds.as_ref().map(|shown| shown.open_clouds.all());
    all.and_then(|all| all.get(index)).is_some_and(|open_cloud| open_cloud.pyramid().is_some())
}

fn suggested_name(window: &Window, index: usize, written: &[String]) -> String {
    let all = window.document.clouds.as_ref().map(|shown| shown.open_clouds.all());
    let Some(open_cloud) = all.and_then(|all| all.get(index)) else {
        return "cloud.ply".to_owned();
    };
    let name = open_cloud.name();
    let (name, ending) = match name.rsplit_once('.') {
        Some((name, ending)) if written.iter().any(|known| known == ending) => (name, ending),
        Some((name, "ply")) => (name, "ply"),
        _ => (name.as_str(), "ply"),
    };
    let plain = |c: char| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' };
    let name: String = name.chars().map(plain).collect();
    let name = name.split('-').filter(|part| !part.is_empty()).collect::<Vec<_>>().join("-");
    format!("{name}-edited.{ending}")
}
