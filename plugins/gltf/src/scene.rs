//! Which meshes a scene shows, and where.

use gltf::json::{Node, Root};
use surfelshop_api::glam::{DMat4, DQuat, DVec3};
use surfelshop_api::prelude::{Error, Result};

/// A mesh where a node shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Instance {
    pub mesh: usize,
    /// From the mesh's coordinates to the world's.
    pub matrix: DMat4,
}

/// What a scene shows.
#[derive(Debug, Default)]
pub(crate) struct Scene {
    pub name: String,
    pub instances: Vec<Instance>,
    /// What is doubtful.
    pub warnings: Vec<String>,
}

/// A node's own movement.
fn matrix(node: &Node) -> DMat4 {
    if let Some(columns) = node.matrix {
        return DMat4::from_cols_array(&columns.map(f64::from));
    }
    let vector = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    let rotation = node.rotation.map_or([0.0, 0.0, 0.0, 1.0], |rotation| rotation.0);
    let rotation = DQuat::from_array(rotation.map(f64::from));
    let length = rotation.length();
    let turns = length.is_finite() && length > 1e-12;
    DMat4::from_scale_rotation_translation(
        node.scale.map_or(DVec3::ONE, vector),
        if turns { rotation / length } else { DQuat::IDENTITY },
        node.translation.map_or(DVec3::ZERO, vector),
    )
}

impl Scene {
    /// The scene that the file names, or the first; without any, every mesh once.
    ///
    /// # Errors
    /// Where a scene or a node is not there.
    pub(crate) fn of(root: &Root) -> Result<Self> {
        let named = root.scene.map(|scene| scene.value());
        let mut found = Self::default();
        if named.is_none() && root.scenes.is_empty() {
            let shown = |mesh| Instance { mesh, matrix: DMat4::IDENTITY };
            found.instances = (0..root.meshes.len()).map(shown).collect();
            return Ok(found);
        }
        let number = named.unwrap_or(0);
        let missing = || Error::new(format!("expected a scene {number}, found none"));
        let scene = root.scenes.get(number).ok_or_else(missing)?;
        if root.scenes.len() > 1 {
            let n = root.scenes.len();
            found.warnings.push(format!("one of {n} scenes was read"));
        }
        found.name = scene.name.clone().unwrap_or_default();
        let roots: Vec<usize> = scene.nodes.iter().map(|node| node.value()).collect();
        found.visit(root, &roots)?;
        Ok(found)
    }

    /// Goes through nodes and all below them, each node once.
    fn visit(&mut self, root: &Root, roots: &[usize]) -> Result<()> {
        let mut seen = vec![false; root.nodes.len()];
        let (mut n_again, mut has_skins) = (0, false);
        let mut open: Vec<(usize, DMat4)> =
            roots.iter().rev().map(|&node| (node, DMat4::IDENTITY)).collect();
        while let Some((number, above)) = open.pop() {
            let missing = || Error::new(format!("expected a node {number}, found none"));
            let node = root.nodes.get(number).ok_or_else(missing)?;
            if std::mem::replace(&mut seen[number], true) {
                n_again += 1;
                continue;
            }
            let matrix = above * matrix(node);
            if let Some(mesh) = node.mesh {
                self.instances.push(Instance { mesh: mesh.value(), matrix });
            }
            has_skins |= node.skin.is_some();
            let children = node.children.iter().flatten().rev();
            open.extend(children.map(|child| (child.value(), matrix)));
        }
        if n_again > 0 {
            self.warnings
                .push(format!("{n_again} nodes are below several others, and were read once"));
        }
        if has_skins {
            self.warnings
                .push("skins are not read: meshes have the shape they are stored in".to_owned());
        }
        Ok(())
    }
}
