//! The list of methods that the commands compare: a new one is a row.

use std::time::Instant;

use Chart::{Beyond, Comparison, Families, Glance, Growth, Own as OwnProblem, Paper, Precisions};
use How::{Double, Mixed, Own, Single};
use hlcp_core::Aor;
use hlcp_methods::{
    DynRows, Limits, NameError, Named, Newton, Options, Parameters, Preconditioner, Ssor, Tmms,
    TridiagonalPart, solve_mixed,
};

use super::{
    peers,
    run::{Judged, Run, run, solve},
};
use crate::{
    Fallible,
    chart::{COLOURS, DASHES, MARKERS},
    scenes::{Problem, where_it_applies},
};

/// What draws or measures a list of methods.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Chart {
    /// Seven methods on the first chart of `speed-vs-accuracy`.
    Glance,
    /// Methods that leave no parameter open, there on a problem of one's own.
    Own,
    /// The paper's methods there, with the outside anchors last.
    Paper,
    /// There, methods beyond the paper, with the paper's plainest and fastest, and the anchors.
    Beyond,
    /// There, two methods in three precisions.
    Precisions,
    /// `comparison`.
    Comparison,
    /// Seven of these on its first chart.
    Growth,
    /// The rivals of `AUTO` on `families`.
    Families,
}

/// A method with what it looks like on charts.
pub(crate) struct Row {
    /// The name on the charts of `speed-vs-accuracy`.
    pub(crate) label: &'static str,
    /// The name for `--method`. Parameters that it leaves open are the best known.
    pub(crate) name: &'static str,
    how: How,
    /// Colour, dash and marker.
    pub(crate) style: [usize; 3],
    on: &'static [Chart],
}

/// How `speed-vs-accuracy` solves by a method.
enum How {
    Double,
    Single,
    Mixed,
    /// By a function of its own; nothing where it does not apply.
    Own(fn(&Scene, &Limits) -> Fallible<Option<Run>>),
}

#[rustfmt::skip] // a table
const METHODS: &[Row] = &[
    row("MGS", "MGS", Double, [0, 0, 0], &[Paper, Comparison, Families, Growth]),
    row("MSOR, best", "MSOR", Double, [0, 1, 1], &[Paper]),
    row("MAOR, best", "MAOR", Double, [0, 2, 2], &[Paper]),
    row("AMGS", "AMGS", Double, [1, 3, 3], &[Paper, Comparison]),
    row("AMAOR, best", "AMAOR", Double, [1, 1, 5], &[Paper]),
    row("TMSOR, best", "TMSOR", Double, [2, 3, 0], &[Paper]),
    row("TMAOR, best", "TMAOR", Double, [2, 4, 1], &[Paper]),
    row("TMGS", "TMGS", Double, [2, 2, 6], &[Paper, Beyond, Comparison, Families, Glance, Growth, OwnProblem]),
    row("AMSOR, best", "AMSOR", Double, [1, 0, 4], &[Paper, Beyond, Comparison, Glance, Growth]),
    row("Anderson (10), TMGS", "ANDERSON", Double, [3, 0, 2], &[Beyond, Comparison, Families, Growth, OwnProblem]),
    row("Newton, lines", "", Own(|scene, limits| newton(scene, TridiagonalPart::new(), limits)), [4, 3, 5], &[Beyond]),
    row("Newton, SSOR", "NEWTON", Own(|scene, limits| newton(scene, Ssor, limits)), [4, 2, 4], &[Beyond, Comparison, Families, Growth]),
    row("Newton, AMG", "AMG", Double, [6, 2, 5], &[Beyond, Families, OwnProblem]),
    row("multigrid, W", "MGW", Double, [5, 4, 0], &[Beyond, Comparison, Families, Glance, OwnProblem]),
    row("multigrid, F", "MGF", Double, [5, 1, 1], &[Comparison, Families]),
    row("full multigrid", "FMG", Double, [5, 2, 2], &[Beyond, Comparison, Families, Growth]),
    row("auto", "AUTO", Double, [6, 0, 3], &[Beyond, Comparison, Glance, Growth, OwnProblem]),
    row("pivoting", "PIVOTING", Double, [6, 4, 1], &[Families]),
    row("adaptive SOR", "ADAPTIVE", Double, [6, 1, 4], &[Families, OwnProblem]),
    row("projected SOR", "", Own(peers::projected), [3, 1, 3], &[Paper, Beyond, Glance]),
    row("Newton, sparse LU", "", Own(|scene, limits| peers::newton(&scene.wide.problem, limits).map(Some)), [4, 4, 6], &[Paper, Beyond, Glance, OwnProblem]),
    row("FBNS, sparse LU", "", Own(|scene, limits| peers::fbns(&scene.wide.problem, limits).map(Some)), [4, 0, 0], &[Paper, Beyond, Glance, OwnProblem]),
    row("TMGS, f64", "TMGS", Double, [2, 2, 6], &[Precisions]),
    row("TMGS, f32", "TMGS", Single, [2, 0, 5], &[Precisions]),
    row("TMGS, mixed", "TMGS", Mixed, [2, 1, 2], &[Precisions]),
    row("AMSOR, f64", "AMSOR", Double, [1, 0, 4], &[Precisions]),
    row("AMSOR, f32", "AMSOR", Single, [1, 2, 6], &[Precisions]),
    row("AMSOR, mixed", "AMSOR", Mixed, [1, 3, 0], &[Precisions]),
];

const fn row(
    label: &'static str,
    name: &'static str,
    how: How,
    style: [usize; 3],
    on: &'static [Chart],
) -> Row {
    Row { label, name, how, style, on }
}

// Two lines in one chart differ in colour or marker, and the last two markers are left to others.
// The precisions have a chart to themselves.
const _: () = {
    let mut k = 0;
    while k < METHODS.len() {
        let [colour, dash, marker] = METHODS[k].style;
        assert!(colour < COLOURS.len() && dash < DASHES.len() && marker + 2 < MARKERS.len());
        let mut other = 0;
        while other < k {
            let [colour_of_other, _, marker_of_other] = METHODS[other].style;
            let together =
                matches!(METHODS[other].on, [Precisions]) == matches!(METHODS[k].on, [Precisions]);
            assert!(!together || colour != colour_of_other || marker != marker_of_other);
            other += 1;
        }
        k += 1;
    }
};

pub(crate) fn methods(chart: Chart) -> Vec<&'static Row> {
    const { &METHODS }.iter().filter(|row| row.on.contains(&chart)).collect()
}

/// Whether a series has the label of a method.
pub(crate) fn is_listed(label: &str) -> bool {
    const { &METHODS }.iter().any(|row| row.label == label)
}

/// A scene of `speed-vs-accuracy` in both precisions.
pub(crate) struct Scene {
    pub(crate) name: &'static str,
    /// The points per side, or what the scene has in their place.
    pub(crate) m: f64,
    pub(crate) wide: Judged,
    pub(crate) narrow: Problem<f32>,
}

impl Scene {
    /// Returns the best known α, β and τ for the parameters that a name of the paper leaves open:
    /// those of docs/results.md.
    fn best(&self, name: &str) -> [f64; 3] {
        // The best α of AMSOR on the discs grows with the grid as that of SOR does on a linear
        // system.
        let sor = 2.0 - 6.4 / self.m;
        // Of MMS, AMMS and TMMS, each with SOR and with AOR.
        let known = match self.name {
            "example1" => [
                [[1.1, 1.1, 1.0], [1.0, 1.4, 0.8]],
                [[1.1, 1.1, 1.0], [1.0, 1.4, 0.8]],
                [[1.1, 1.1, 1.0], [1.0, 1.2, 0.8]],
            ],
            "example2" => [
                [[1.0, 1.0, 0.8], [1.0, 1.2, 0.8]],
                [[1.0, 1.0, 1.0], [1.0, 1.2, 1.0]],
                [[1.1, 1.1, 1.0], [1.0, 1.2, 0.8]],
            ],
            "slider" => [
                [[1.3, 1.3, 0.8], [1.5, 1.3, 0.8]],
                [[1.5, 1.5, 0.6], [1.3, 1.5, 0.6]],
                [[1.3, 1.3, 0.8], [1.1, 1.5, 0.4]],
            ],
            "film" => [[[1.2, 1.2, 1.0]; 2], [[1.4, 1.4, 0.5]; 2], [[1.3, 1.3, 0.8]; 2]],
            "disc-lcp" => [
                [[1.1, 1.1, 0.6], [1.1, 1.5, 0.4]],
                [[sor, sor, 1.0], [1.6, 1.6, 0.8]],
                [[1.3, 1.3, 1.0], [1.0, 1.4, 0.4]],
            ],
            _ => [
                [[1.6, 1.6, 1.0], [1.4, 1.8, 0.6]],
                [[sor, sor, 1.0], [1.6, 1.6, 0.8]],
                [[1.5, 1.5, 1.0], [1.3, 1.7, 0.6]],
            ],
        };
        let family = ["M", "AM", "TM"].iter().position(|family| {
            name.strip_prefix(family).is_some_and(|splitting| ["SOR", "AOR"].contains(&splitting))
        });
        match family {
            Some(family) => known[family][usize::from(name.ends_with("AOR"))],
            None => [1.0; 3],
        }
    }
}

impl Row {
    /// Solves a scene; nothing where the method does not take such operators.
    pub(crate) fn solve(&self, scene: &Scene, limits: &Limits) -> Fallible<Option<Run>> {
        let Scene { wide: Judged { problem, .. }, narrow, .. } = scene;
        if let Own(solve) = self.how {
            return solve(scene, limits);
        }
        let [alpha, beta, tau] = scene.best(self.name);
        let method = tuned(self.name, [alpha, beta])?;
        let run = || match self.how {
            Single => solve(narrow, &method, tau, limits),
            Mixed => {
                let begin = Instant::now();
                let mut wide = problem.solved_by(&method, tau)?;
                let mut narrow = narrow.solved_by(&method, tau)?;
                let outcome = solve_mixed(
                    &mut narrow,
                    &mut wide,
                    &problem.q,
                    Options::from_x(&problem.start()).limits(*limits),
                )?;
                Ok(Run::new(begin, outcome, &wide))
            }
            _ => solve(problem, &method, tau, limits),
        };
        Ok(where_it_applies(run())?)
    }
}

/// Returns the method of a name, with those of the parameters α and β that it leaves open.
pub(crate) fn tuned(name: &str, [alpha, beta]: [f64; 2]) -> Result<Named, NameError> {
    let [sor, aor] = ["SOR", "AOR"].map(|splitting| name.ends_with(splitting));
    let alpha = (sor || aor).then_some(alpha);
    Named::parse(name, Parameters { alpha, beta: aor.then_some(beta), ..Parameters::default() })
}

/// Solves by Newton's method with an inner solver that the name `NEWTON` would choose.
fn newton<P>(scene: &Scene, inner: P, limits: &Limits) -> Fallible<Option<Run>>
where
    P: for<'p> Preconditioner<f64, DynRows<'p, f64>, DynRows<'p, f64>>,
{
    let problem = &scene.wide.problem;
    let made = run(problem, limits, || {
        let base = Tmms::mirrored(problem.hlcp(1.0)?, Aor::gauss_seidel().accelerated())?;
        Ok(Newton::new(base, inner))
    });
    Ok(Some(made?))
}
