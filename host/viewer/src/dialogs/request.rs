//! The title, filter and suggested name of a file dialog.

use super::file_dialog::{Purpose, Request};
use super::state::DialogPurpose;
use crate::document::file_names::{cloud_file_name, scene_file_name};
use crate::window::Window;
use std::path::{Path, PathBuf};

/// Describes a dialog.
pub(super) fn request(window: &Window, purpose: &DialogPurpose) -> Request {
    let endings = |endings: &[&str]| endings.iter().map(|ending| (*ending).to_owned()).collect();
    let request = |title: &str, filter: &str, of: &[&str], purpose: Purpose| Request {
        title: title.to_owned(),
        filter: filter.to_owned(),
        endings: endings(of),
        purpose,
    };
    let save = |name: &str, completed: fn(&Path) -> PathBuf| Purpose::Save {
        name: name.to_owned(),
        completed,
    };
    match purpose {
        DialogPurpose::Open => {
            let known = ["ply", "obj", "off", "toml", "hdr", "exr"];
            request("Open clouds or a scene", "clouds and scenes", &known, Purpose::OpenSeveral)
        }
        DialogPurpose::SaveScene => {
            let purpose = save("surfelshop.scene.toml", scene_file_name);
            request("Save the scene", "scenes", &["toml"], purpose)
        }
        DialogPurpose::SaveCloud(index) => {
            let name = suggested_name(window, *index);
            request("Save the cloud", "clouds", &["ply"], save(&name, cloud_file_name))
        }
        DialogPurpose::Pictures => {
            let purpose = save("surfelshop.png", Path::to_owned);
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

/// A name for an edited cloud, other than the one of its source file.
fn suggested_name(window: &Window, index: usize) -> String {
    let all = window.document.clouds.as_ref().map(|shown| shown.open_clouds.all());
    let Some(open_cloud) = all.and_then(|all| all.get(index)) else {
        return "cloud.ply".to_owned();
    };
    let name = open_cloud.name().replace(".ply", "");
    let plain = |c: char| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' };
    let name: String = name.chars().map(plain).collect();
    let name = name.split('-').filter(|part| !part.is_empty()).collect::<Vec<_>>().join("-");
    format!("{name}-edited.ply")
}
