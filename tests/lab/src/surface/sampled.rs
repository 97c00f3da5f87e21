//! A pyramid whose nodes have a choice of the surfels beneath them, as those of other programs have, in the place of
//! merged ones: `surface sampled PYRAMID OUT`. Reports of both say what merging is worth.

use std::path::Path;
use surfelshop_api::Scope;
use surfelshop_cloud::silent;
use surfelshop_pyramid::{Pyramid, RemakeOptions, Rule, remake};

pub(super) fn run(arguments: &[String]) -> anyhow::Result<()> {
    let [input, output] = arguments else {
        anyhow::bail!("expected a pyramid and the file to write, found {arguments:?}");
    };
    let options = RemakeOptions {
        scope: Scope::Surfel,
        what: "a choice of surfels in the place of merged ones",
        depends: &[],
        memory: 4 << 30,
        rule: Rule::Sampled,
        progress: &silent,
    };
    let pyramid = Pyramid::open(Path::new(input))?;
    let done = remake(&pyramid, Path::new(output), &options, &mut |_, _| Ok(None))?;
    println!("{output}: {} surfels in {} nodes", done.n_surfels, done.n_nodes);
    Ok(())
}
