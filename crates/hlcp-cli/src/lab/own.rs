//! A problem that is measured: a scene with its numbers, or files.

use std::path::PathBuf;

use clap::Args;
use hlcp::files::printable;
use hlcp_core::Scalar;
use hlcp_methods::Limits;

use crate::{
    Fallible,
    scenes::{Files, Given, Pose, Problem, Scene},
};

#[derive(Clone, Args)]
pub(super) struct Own {
    // First: it looks at `--a` before that is taken.
    #[command(flatten)]
    given: Given,
    #[command(flatten)]
    files: Files,
    /// What charts call a problem that nobody typed.
    #[arg(skip)]
    called: Option<String>,
    /// Whether the planted solution is a generic one of the same pattern.
    #[arg(skip)]
    pub(super) is_generic: bool,
}

impl Own {
    /// Returns a scene with numbers that differ from its defaults, and what charts call it.
    pub(super) fn scene(name: &str, numbers: &[(&'static str, f64)], called: String) -> Self {
        let scene = Scene::of(name);
        let given = Given { scene, numbers: scene.numbers(numbers), is_asked: true };
        Self { given, files: Files::default(), called: Some(called), is_generic: false }
    }

    pub(super) fn is_asked(&self) -> bool {
        self.given.is_asked || self.files.a.is_some()
    }

    /// The name of the scene, unless the problem is from files.
    pub(super) fn name(&self) -> &'static str {
        if self.files.a.is_some() { "files" } else { self.given.scene.name }
    }

    pub(super) fn size(&self) -> f64 {
        self.given.numbers.first()
    }

    /// Returns what a chart calls the problem: no other has the same.
    pub(super) fn title(&self) -> String {
        let typed = self.typed().into_iter();
        match (&self.called, &self.files.a) {
            (Some(title), _) => title.clone(),
            (_, Some(_)) => typed.map(|(_, path)| path).collect::<Vec<_>>().join(", "),
            (None, None) => {
                let words: String = typed.map(|(name, v)| format!(", {name} = {v}")).collect();
                self.given.scene.name.to_owned() + &words
            }
        }
    }

    /// Returns the options that name the problem.
    pub(super) fn options(&self) -> String {
        let words = self.typed().into_iter().map(|(name, v)| format!(" --{name} {v}"));
        let words = words.collect::<String>();
        let is_scene = self.files.a.is_none();
        if is_scene { format!(" --scene {}{words}", self.given.scene.name) } else { words }
    }

    /// Returns the options as a part of the name of a file, without a point.
    pub(super) fn file(&self) -> String {
        let words = self.options().replace(" --", " ").replace(" -", " minus").replace('.', "_");
        let words = words.trim().trim_start_matches("scene ");
        let letter = |c: char| if c.is_alphanumeric() || c == '_' { c } else { '-' };
        format!("own-{}", words.chars().map(letter).collect::<String>())
    }

    /// Returns the files, or the numbers of the scene, with their options.
    fn typed(&self) -> Vec<(&'static str, String)> {
        let Files { a, b, q, .. } = &self.files;
        if a.is_none() {
            return self.given.numbers.typed();
        }
        let path = |path: &Option<PathBuf>| Some(printable(path.as_ref()?.display()));
        let paths = [("a", a), ("b", b), ("q", q)].into_iter();
        paths.filter_map(|(name, of)| Some((name, path(of)?))).collect()
    }

    fn posed<T: Scalar>(&self, pose: Pose<T>) -> Fallible<Problem<T>> {
        self.files.read_or(|| pose(&self.given.numbers))
    }

    pub(super) fn wide(&self) -> Fallible<Problem<f64>> {
        self.posed(self.given.scene.wide)
    }

    pub(super) fn narrow(&self) -> Fallible<Problem<f32>> {
        self.posed(self.given.scene.narrow)
    }

    pub(super) fn limits(&self) -> Limits {
        match &self.files.a {
            Some(_) => Limits::relative(1e-10),
            None => self.given.scene.limits(),
        }
    }
}
