//! What each renderer of a picture is told of its clouds.

use std::collections::BTreeSet;
use surfelshop_api::{CloudFacts, CloudInfo, CloudView};

/// The facts without some clouds: these keep their numbers and have no surfels and no columns. The bounds stay
/// those of the whole scene, which lights and lengths go by.
pub(super) fn without(facts: &CloudFacts, left_out: &[u32]) -> CloudFacts {
    let mut known = facts.clone();
    if left_out.is_empty() {
        return known;
    }
    for (i, cloud) in (0..).zip(&mut known.clouds) {
        if left_out.contains(&i) {
            known.n_surfels = known.n_surfels.saturating_sub(cloud.n_surfels);
            *cloud = CloudInfo { name: std::mem::take(&mut cloud.name), ..CloudInfo::default() };
        }
    }
    let columns = known.clouds.iter().flat_map(|cloud| &cloud.columns);
    let there: BTreeSet<&str> = columns.map(|column| column.name.as_str()).collect();
    let columns = facts.columns.iter().filter(|name| there.contains(name.as_str()));
    known.columns = columns.cloned().collect();
    known
}

/// The clouds that are given as data without some of them, where the others are.
pub(super) fn data_without<'a>(clouds: &[CloudView<'a>], left_out: &[u32]) -> Vec<CloudView<'a>> {
    let of = |(i, cloud): (u32, &CloudView<'a>)| match left_out.contains(&i) {
        true => CloudView { len: 0, columns: Vec::new(), faces: &[], ..cloud.clone() },
        false => cloud.clone(),
    };
    (0..).zip(clouds).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use surfelshop_api::ColumnInfo;
    use surfelshop_api::columns::{Element, Role};

    #[test]
    fn what_is_left_out_keeps_its_number_and_the_bounds_stay() {
        let column = |name: &str| ColumnInfo {
            name: name.to_owned(),
            components: 1,
            element: Element::F32,
            role: Role::Plain,
        };
        let cloud = |n_surfels, names: &[&str]| CloudInfo {
            n_surfels,
            columns: names.iter().map(|name| column(name)).collect(),
            ..CloudInfo::default()
        };
        let facts = CloudFacts {
            n_surfels: 5,
            bounds_max: DVec3::ONE,
            columns: ["ao", "opacity", "position"].map(str::to_owned).to_vec(),
            clouds: vec![cloud(2, &["position", "opacity"]), cloud(3, &["ao", "position"])],
            ..CloudFacts::default()
        };
        assert_eq!(without(&facts, &[]), facts);
        let rest = without(&facts, &[0]);
        assert_eq!((rest.n_surfels, rest.bounds_max), (3, DVec3::ONE));
        assert_eq!(rest.columns, ["ao", "position"]);
        assert_eq!(rest.clouds[0], CloudInfo::default());
        assert_eq!(rest.clouds[1], facts.clouds[1]);
    }
}
