//! Spherical harmonics of clouds as a function of WGSL.

use crate::CloudFacts;
use crate::columns::SH;
use crate::graph::{BufferColumn, Columns, Graph, Pass};
use std::fmt::Write;

/// The most that is radiated, so that sums are finite: as much as albedos may be.
const MOST: f32 = 65_504.0;

/// Columns of spherical harmonics, and the WGSL module that adds them up: see [`Graph::radiance`].
#[derive(Clone, Debug, PartialEq)]
pub struct Radiance {
    bands: Vec<Columns>,
    path: String,
    wgsl: String,
}

impl Graph {
    /// Declares the columns `sh_0` to `sh_3` of these clouds, up to an order and as far as any of them has them, as
    /// [`columns`](Self::columns) does. Passes that [read](Pass::reads_radiance) them import `path`, with
    /// `fn toward(i: u32, direction: vec3<f32>) -> vec3<f32>`: what surfel `i` radiates along a unit direction that goes
    /// away from the eye, one half and the sum of its harmonics, from 0 to 65,504. Orders above 0 are stored with eleven
    /// significant bits. `objects` are those of [`columns`](Self::columns), too, so that numbers of surfels agree.
    pub fn radiance(
        &mut self,
        path: &str,
        facts: &CloudFacts,
        objects: &[u32],
        order: u32,
    ) -> Radiance {
        let clouds = || objects.iter().filter_map(|i| facts.clouds.get(*i as usize));
        let is_there = |band: &str| clouds().any(|cloud| cloud.column(band).is_some());
        let (mut bands, mut imports) = (Vec::new(), String::new());
        let (mut loads, mut terms) = (String::new(), String::new());
        for (l, band) in SH.into_iter().enumerate().take(order as usize + 1) {
            if l > 0 && !is_there(band) {
                break;
            }
            let n = 3 * (2 * l as u32 + 1);
            let column = BufferColumn::new(band, n);
            let column = if l == 0 { column } else { column.f16() };
            let own = format!("{path}_{}", ["a", "b", "c", "d"][l]);
            bands.push(self.columns(&own, facts, objects, &[column]).1);
            let _infallible = writeln!(imports, "#import {own}");
            if l == 0 {
                terms = format!(" + sh::ORDER_0 * {own}::{band}(i)");
                continue;
            }
            for k in 0..n.div_ceil(2) {
                let _infallible = writeln!(loads, "let {own}_{k}w = {own}::{band}(i, {k}u);");
            }
            let value = |at: u32| format!("{own}_{}w[{}]", at / 2, at % 2);
            let vector = |c: u32| format!("vec3({}, {}, {})", value(c), value(c + 1), value(c + 2));
            let vectors: Vec<String> = (0..n).step_by(3).map(vector).collect();
            let _infallible = write!(terms, " + sh::rgb_of_order_{l}(d, {})", vectors.join(", "));
        }
        let wgsl = format!(
            "#define_import_path {path}\n#import surfelshop::sh\n{imports}\
             fn toward(i: u32, d: vec3<f32>) -> vec3<f32> {{\n{loads}\
                 return clamp(vec3(0.5){terms}, vec3(0.0), vec3({MOST:?}));\n\
             }}\n"
        );
        Radiance { bands, path: path.to_owned(), wgsl }
    }
}

impl Pass {
    /// Reads spherical harmonics: the shader imports their path.
    #[must_use]
    pub fn reads_radiance(self, radiance: &Radiance) -> Self {
        let Radiance { bands, path, wgsl } = radiance;
        let pass = bands.iter().fold(self, Self::reads);
        pass.module(path, "spherical harmonics of clouds", wgsl)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::{Element, Role};
    use crate::{CloudInfo, ColumnInfo};

    #[test]
    fn orders_end_where_no_cloud_has_them() {
        let role = Role::SphericalHarmonics(1);
        let (name, element) = (SH[1].to_owned(), Element::F32);
        let columns = vec![ColumnInfo { name, components: 9, element, role }];
        let cloud = CloudInfo { n_surfels: 5, columns, ..CloudInfo::default() };
        let facts = CloudFacts { clouds: vec![cloud], ..CloudFacts::default() };
        for (order, n) in [(0, 1), (1, 2), (3, 2)] {
            let radiance = Graph::new().radiance("light", &facts, &[0], order);
            assert_eq!(radiance.bands.len(), n, "{order}");
            assert_eq!(radiance.wgsl.contains("rgb_of_order_1(d, vec3("), order > 0);
            assert!(!radiance.wgsl.contains("rgb_of_order_2"));
        }
    }
}
