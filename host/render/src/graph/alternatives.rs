//! Passes that need something which only some devices have, and what runs instead.

use crate::gpu::Gpu;
use crate::graph::RenderError;
use crate::shader_features::ShaderFeature;
use surfelshop_api::graph::Pass;

/// Most passes of which each runs instead of the one before.
const MAX_ALTERNATIVES: usize = 16;

/// What devices may have besides what shaders use.
const OTHERS: [&str; 3] = ["volume-storage", "float32-blendable", "float32-filterable"];

/// The pass that runs on a device.
pub(super) struct Chosen {
    pub(super) pass: Pass,
    /// What it runs instead of, and why, in words.
    pub(super) instead_of: Option<String>,
    /// Alternatives that could run here, too.
    pub(super) others: Vec<Pass>,
}

/// The first of a pass and its alternatives that a device can run.
///
/// # Errors
/// Where it can run none, or one needs what no device has.
pub(super) fn choose(pass: &Pass, gpu: &Gpu) -> Result<Chosen, RenderError> {
    let has: Vec<&str> = gpu.feature_words().collect();
    choose_of(pass, &has, &gpu.describe())
}

fn choose_of(pass: &Pass, has: &[&str], device: &str) -> Result<Chosen, RenderError> {
    let (mut able, mut unable) = (Vec::new(), Vec::new());
    let mut next = Some(pass);
    while let Some(pass) = next {
        let refuse = |what: String| Err(RenderError::pass(&pass.name, what));
        if able.len() + unable.len() > MAX_ALTERNATIVES {
            return refuse(format!("it is more than {MAX_ALTERNATIVES} alternatives down"));
        }
        let known = |word: &&String| {
            OTHERS.contains(&word.as_str()) || ShaderFeature::of_word(word).is_some()
        };
        if let Some(word) = pass.needs.iter().find(|word| !known(word)) {
            let all = OTHERS.into_iter().chain(ShaderFeature::ALL.map(|feature| feature.word));
            let all = all.collect::<Vec<_>>().join(", ");
            let word = word.escape_debug();
            return refuse(format!("it needs `{word}`, which is no feature; there are: {all}"));
        }
        match pass.needs.iter().find(|word| !has.contains(&word.as_str())) {
            None => able.push(Pass { instead: None, ..pass.clone() }),
            Some(word) if pass.instead.is_none() && able.is_empty() => {
                return refuse(format!(
                    "it needs `{word}`, which {device} lacks; give a pass that does without, by `instead`"
                ));
            }
            // Of those behind the one that runs nothing is told.
            Some(word) if able.is_empty() => {
                unable.push(format!("`{}`, which needs `{word}`", pass.name));
            }
            Some(_) => {}
        }
        next = pass.instead.as_deref();
    }
    let mut able = able.into_iter();
    let Some(pass) = able.next() else {
        return Err(RenderError::pass(&pass.name, "nothing runs of it and its alternatives"));
    };
    let instead_of = (!unable.is_empty()).then(|| unable.join(" and "));
    Ok(Chosen { pass, instead_of, others: able.collect() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::graph::Groups;

    fn pass(name: &str) -> Pass {
        Pass::compute(name, "", "f", Groups::Fixed([1; 3]))
    }

    fn refused(pass: &Pass, has: &[&str]) -> String {
        choose_of(pass, has, "a card").err().map(|error| error.to_string()).unwrap_or_default()
    }

    #[test]
    fn the_first_that_the_device_can_run_is_chosen_and_the_others_are_told() {
        let fast = pass("fast").needs("f16").needs("subgroups");
        let all = fast.instead(pass("good").needs("subgroups")).instead(pass("slow"));
        let chosen = |has: &[&str]| {
            let Chosen { pass, instead_of, others } = choose_of(&all, has, "a card").unwrap();
            (pass.name, instead_of, others.into_iter().map(|other| other.name).collect::<Vec<_>>())
        };
        let both = ["good", "slow"].map(str::to_owned).to_vec();
        assert_eq!(chosen(&["f16", "subgroups"]), ("fast".to_owned(), None, both));
        let why = Some("`fast`, which needs `f16`".to_owned());
        assert_eq!(chosen(&["subgroups"]), ("good".to_owned(), why, vec!["slow".to_owned()]));
        let why = "`fast`, which needs `f16` and `good`, which needs `subgroups`".to_owned();
        assert_eq!(chosen(&[]), ("slow".to_owned(), Some(why), vec![]));
    }

    #[test]
    fn what_nothing_runs_of_is_refused_with_pass_feature_and_device() {
        let all = pass("fast").needs("f16").instead(pass("good").needs("subgroups"));
        let line = refused(&all, &[]);
        assert!(line.contains("pass `good`: it needs `subgroups`, which a card lacks"), "{line}");
        assert_eq!(refused(&all, &["subgroups"]), "");
        let line = refused(&pass("fast").needs("wings"), &["wings"]);
        assert!(line.contains("it needs `wings`, which is no feature"), "{line}");
        let long = (0..20).fold(pass("p"), |all, _| all.instead(pass("q")));
        assert!(refused(&long, &[]).contains("more than 16 alternatives"));
    }
}
