//! Whether the clouds in view have what a renderer reads of them.

use surfelshop_api::{CloudFacts, Need};

/// What is missing, where no cloud has all that a renderer requires; `None` where one has, and where there is no surfel.
pub(super) fn missing(needs: &[Need], facts: &CloudFacts) -> Option<String> {
    let required: Vec<&Need> = needs.iter().filter(|need| need.required).collect();
    if required.is_empty() || facts.n_surfels == 0 {
        return None;
    }
    let lacks = |cloud: &surfelshop_api::CloudInfo| -> Vec<String> {
        cloud.lacks(needs).map(Need::to_string).collect()
    };
    let lacking: Vec<Vec<String>> = facts.clouds.iter().map(lacks).collect();
    if lacking.iter().any(Vec::is_empty) {
        return None;
    }
    let wanted: Vec<String> = required.iter().map(|need| need.to_string()).collect();
    let here = lacking.iter().min_by_key(|lacks| lacks.len()).map(|lacks| lacks.join(", "));
    let here = here.filter(|_| lacking.len() == 1).map_or_else(
        || format!("none of the {} clouds has them all", lacking.len()),
        |lacks| format!("the cloud lacks {lacks}"),
    );
    Some(format!(
        "the renderer draws clouds with {}; {here}; choose another renderer, or a cloud that has them",
        wanted.join(", ")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::columns::{Element, Role, SPLAT_ROTATION, SPLAT_SCALE};
    use surfelshop_api::{CloudInfo, ColumnInfo, NeedInfo};

    fn facts(clouds: &[&[(&str, u32)]]) -> CloudFacts {
        let column = |&(name, components): &(&str, u32)| ColumnInfo {
            name: name.to_owned(),
            components,
            element: Element::F32,
            role: Role::Plain,
        };
        let cloud = |columns: &&[(&str, u32)]| CloudInfo {
            n_surfels: 1,
            columns: columns.iter().map(column).collect(),
            ..CloudInfo::default()
        };
        let clouds = clouds.iter().map(cloud).collect();
        CloudFacts { n_surfels: 1, clouds, ..CloudFacts::default() }
    }

    #[test]
    fn a_line_says_what_is_missing_of_all_clouds() {
        let needs: Vec<Need> = [
            NeedInfo::column(SPLAT_SCALE, 2),
            NeedInfo::column(SPLAT_ROTATION, 4),
            NeedInfo::column("opacity", 1).optional(),
        ]
        .iter()
        .map(Need::from)
        .collect();
        assert_eq!(needs[1].role, Role::Quaternion);
        let whole: &[(&str, u32)] = &[(SPLAT_SCALE, 3), (SPLAT_ROTATION, 4)];
        assert_eq!(missing(&needs, &facts(&[whole])), None);
        assert_eq!(missing(&needs, &facts(&[&[], whole])), None);
        assert_eq!(missing(&[], &facts(&[&[]])), None);
        assert_eq!(missing(&needs, &CloudFacts::default()), None);
        let line = missing(&needs, &facts(&[&[(SPLAT_SCALE, 1), (SPLAT_ROTATION, 4)]])).unwrap();
        assert!(line.contains("the cloud lacks `splat_scale` of 2 components;"), "{line}");
        let line = missing(&needs, &facts(&[&[], &[]])).unwrap();
        assert!(line.contains("none of the 2 clouds"), "{line}");
    }
}
