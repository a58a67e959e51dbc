//! `hlcp modulus`: published methods of the modulus family beside those of the library.
//!
//! Each is a function of a few lines, written from its formula, on the equation
//! `C x = G |x| − γq` with `C = A + BΩ` and `G = BΩ − A`, whose defect is F. `M` is the lower
//! triangle of C. A parameter is the best of a list by sweeps; then the methods are measured in
//! turns. Writes `modulus.md`. Ends with an error if an answer is not that of `AUTO`.

use std::{path::PathBuf, time::Duration};

use clap::Args;
use hlcp::files::printable;
use hlcp_core::{Hlcp, Norms, Rhs, Rows};
use hlcp_methods::{Clock, DynRows, Method, SparseLu, Work};

use super::{
    methods::tuned,
    own::Own,
    peers::Assembled,
    run::{self, Judged, Repeats, Run, measure, solve, to},
    table::Table,
};
use crate::{
    Fallible,
    chart::{machine, save},
    print,
    progress::counting,
    scenes::Problem,
};

const EXAMPLES: &str = "\
Examples:
  hlcp modulus --quick
  hlcp modulus --out target/results";

/// Measure published methods of the modulus family beside those of the library
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Small problems, measured once
    #[arg(long)]
    quick: bool,
    /// The folder for the table
    #[arg(long, default_value = "docs/results")]
    #[arg(default_value_if("quick", "true", "target/results"))]
    out: PathBuf,
}

/// The name of a parameter, and the values that are tried.
type Parameter = (&'static str, &'static [f64]);

struct Published {
    name: &'static str,
    source: &'static str,
    formula: &'static str,
    parameter: Parameter,
    /// Makes the next iterate from the parameter, what is kept, and the one before.
    next: fn(&Equation<'_>, f64, &mut Memory, &[f64], &mut [f64]),
}

const NONE: Parameter = ("", &[0.0]);
const SHIFTS: Parameter = ("θ", &[-0.45, -0.4, -0.3, -0.2, -0.1, 0.0, 0.1, 0.25, 0.5]);
const MOMENTA: Parameter = ("β", &[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95]);
const RELAXATIONS: Parameter = ("ω", &[0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6]);
const ALPHAS: Parameter =
    ("α", &[0.9, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7, 1.75, 1.8, 1.85, 1.9]);

const METHODS: [Published; 12] = [
    Published {
        name: "modulus-based splitting, in the same loops",
        source: "Bai, Numer. Linear Algebra Appl. 17 (2010) 917–933",
        formula: "M x⁺ = M x − F(x)",
        parameter: NONE,
        next: |equation, _, memory, x, y| equation.c.forward(1.0, 1, &memory.f, x, y),
    },
    Published {
        name: "two-sweep",
        source: "Wu and Li, J. Comput. Appl. Math. 302 (2016) 327–339",
        formula: "M x⁺ = M x − F(x) + U(|x⁻| − |x|), U the upper triangle of −A",
        parameter: NONE,
        next: |equation, _, memory, x, y| {
            let Memory { f, before, .. } = memory;
            let turned: Vec<_> = x.iter().zip(&*before).map(|(x, b)| x.abs() - b.abs()).collect();
            for (i, f) in f.iter_mut().enumerate() {
                *f -= equation
                    .a
                    .row(i)
                    .filter(|(j, _)| *j > i)
                    .map(|(j, a)| a * turned[j])
                    .sum::<f64>();
            }
            equation.c.forward(1.0, 1, f, x, y);
        },
    },
    Published {
        name: "Newton-based splitting",
        source: "Zhou, Wu and Li, J. Comput. Appl. Math. 394 (2021) 113578",
        formula: "(M + θD) x⁺ = (M + θD) x − F(x), D the diagonal of C",
        parameter: SHIFTS,
        next: |equation, theta, memory, x, y| equation.c.forward(1.0 + theta, 1, &memory.f, x, y),
    },
    Published {
        name: "momentum",
        source: "on splittings in Li, Chen and Han, arXiv:2312.10891 (2023)",
        formula: "M x⁺ = M x − F(x) + βD(x − x⁻)",
        parameter: MOMENTA,
        next: |equation, beta, memory, x, y| {
            for (i, f) in memory.f.iter_mut().enumerate() {
                *f -= beta * equation.c.diagonal[i] * (x[i] - memory.before[i]);
            }
            equation.c.forward(1.0, 1, &memory.f, x, y);
        },
    },
    Published {
        name: "relaxation-based splitting",
        source: "Song and Song, Comput. Appl. Math. 42 (2023), doi:10.1007/s40314-022-02157-x",
        formula: "M x⁺ = M x − F(x) − G(|x| − u), u⁺ = (1 − ω)u + ω|x⁺|",
        parameter: RELAXATIONS,
        next: |equation, omega, memory, x, y| {
            equation.lag(memory, x);
            equation.c.forward(1.0, 1, &memory.f, x, y);
            relax(omega, &mut memory.other, y);
        },
    },
    Published {
        name: "SOR-like, one LU",
        source: "Ke and Ma, Appl. Math. Comput. 311 (2017) 195–202",
        formula: "C x⁺ = C x − ω(F(x) + G(|x| − u)), u⁺ = (1 − ω)u + ω|x⁺|",
        parameter: RELAXATIONS,
        next: |equation, omega, memory, x, y| {
            equation.lag(memory, x);
            equation.directly([0.0, omega], memory, x, y);
            relax(omega, &mut memory.other, y);
        },
    },
    Published {
        name: "modified Newton, one LU",
        source: "Wang, Cao and Chen, J. Optim. Theory Appl. 181 (2019) 216–230",
        formula: "(C + θD) x⁺ = (C + θD) x − F(x)",
        parameter: SHIFTS,
        next: |equation, theta, memory, x, y| equation.directly([theta, 1.0], memory, x, y),
    },
    Published {
        name: "preconditioned",
        source: "Li and Zheng, Linear Multilinear Algebra 64 (2016) 1390–1403",
        formula: "M of PC with P = I + S, S minus the first superdiagonal of D⁻¹C: M x⁺ = M x − PF(x)",
        parameter: NONE,
        next: |equation, _, memory, x, y| {
            equation.precondition(&mut memory.f);
            equation.preconditioned.forward(1.0, 1, &memory.f, x, y);
        },
    },
    Published {
        name: "preconditioned two-step",
        source: "Dai, Li, Bai and Qiu, Appl. Math. Comput. 348 (2019) 542–551",
        formula: "the same, then with the upper triangle",
        parameter: NONE,
        next: |equation, _, memory, x, y| {
            equation.precondition(&mut memory.f);
            equation.preconditioned.forward(1.0, 1, &memory.f, x, y);
            let half = y.to_vec();
            equation.posed.defect(equation.q, &half, &mut memory.f, &mut memory.scratch);
            equation.precondition(&mut memory.f);
            equation.preconditioned.backward(&memory.f, &half, y);
            memory.sweeps += 1;
        },
    },
    Published {
        name: "synchronous multisplitting, 4 blocks",
        source: "Bai and Zhang, Numer. Linear Algebra Appl. 20 (2013) 425–439",
        formula: "M the lower triangle of each diagonal block: (D/ω − L) x⁺ = (D/ω − L) x − F(x)",
        parameter: RELAXATIONS,
        next: |equation, omega, memory, x, y| equation.c.forward(1.0 / omega, 4, &memory.f, x, y),
    },
    Published {
        name: "spectral step (Barzilai–Borwein)",
        source: "La Cruz, Martínez and Raydan, Math. Comp. 75 (2006) 1429–1448, without line search",
        formula: "x⁺ = x − σd, d = D⁻¹F(x), σ = sᵀs/sᵀt, s and t the changes of x and of d",
        parameter: NONE,
        next: |equation, _, memory, x, y| {
            let Memory { f, before, other, .. } = memory;
            f.iter_mut().zip(&equation.c.diagonal).for_each(|(f, d)| *f /= d);
            let (mut ss, mut st) = (0.0, 0.0);
            for i in 0..x.len() {
                let s = x[i] - before[i];
                ss += s * s;
                st += s * (f[i] - other[i]);
            }
            // What the source allows of σ; at first, and across a kink, 1.
            let sigma = if st == 0.0 { 1.0 } else { ss / st };
            let sigma = if (1e-10..1e10).contains(&sigma.abs()) { sigma } else { 1.0 };
            for i in 0..x.len() {
                y[i] = x[i] - sigma * f[i];
            }
            other.clone_from(f);
        },
    },
    Published {
        name: "Nesterov's extrapolation",
        source: "O'Donoghue and Candès, Found. Comput. Math. 15 (2015) 715–732, on the splitting",
        formula: "u⁺ = x − M⁻¹F(x), x⁺ = u⁺ + (t − 1)/t⁺ (u⁺ − u), t⁺ = ½(1 + √(1 + 4t²)), from t = 1 again where (x − u⁺)ᵀ(u⁺ − u) > 0",
        parameter: NONE,
        next: |equation, _, memory, x, y| {
            equation.c.forward(1.0, 1, &memory.f, x, y);
            let Memory { other, t, .. } = memory;
            let turn: f64 = (0..x.len()).map(|i| (x[i] - y[i]) * (y[i] - other[i])).sum();
            if turn > 0.0 {
                *t = 1.0;
            }
            let next = 0.5 * (1.0 + (1.0 + 4.0 * *t * *t).sqrt());
            let theta = (*t - 1.0) / next;
            *t = next;
            for (y, u) in y.iter_mut().zip(other) {
                let swept = *y;
                *y += theta * (swept - *u);
                *u = swept;
            }
        },
    },
];

/// Replaces a correction of `x` by the next iterate.
fn descend(x: &[f64], y: &mut [f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y = x - *y);
}

/// Relaxes `u` towards `|x|`.
fn relax(omega: f64, u: &mut [f64], x: &[f64]) {
    u.iter_mut().zip(x).for_each(|(u, x)| *u = (1.0 - omega) * *u + omega * x.abs());
}

/// The matrices of a problem's equation, by rows.
struct Equation<'p> {
    q: &'p [f64],
    posed: Hlcp<f64, DynRows<'p, f64>, DynRows<'p, f64>>,
    a: Assembled,
    c: Assembled,
    g: Assembled,
    preconditioned: Assembled,
}

/// What a method keeps from step to step.
#[derive(Default)]
struct Memory {
    /// F(x).
    f: Vec<f64>,
    /// The iterate before; at first x.
    before: Vec<f64>,
    /// |x| of relaxed methods, the last sweep's end or direction of others; at first |x⁰|.
    other: Vec<f64>,
    t: f64,
    lu: Option<SparseLu>,
    sweeps: usize,
    scratch: Vec<f64>,
}

impl<'p> Equation<'p> {
    fn new(problem: &'p Problem<f64>, tau: f64) -> Fallible<Self> {
        let (posed, n) = (problem.hlcp(tau)?, problem.q.len());
        let (a, b) = (&problem.a, &problem.b);
        let sum = |of_a: f64, of_b: f64| {
            let omega = posed.omega();
            Assembled::new(n, |i, visit| {
                a.visit_row(i, &mut |j, a| visit(j, of_a * a));
                b.visit_row(i, &mut |j, b| visit(j, of_b * omega.entry(j) * b));
            })
        };
        let [a, c, g] = [sum(1.0, 0.0), sum(1.0, 1.0), sum(-1.0, 1.0)];
        let preconditioned = Assembled::new(n, |i, visit| {
            c.row(i).for_each(|(j, c)| visit(j, c));
            let s = c.superdiagonal(i);
            if s != 0.0 {
                c.row(i + 1).for_each(|(j, c)| visit(j, -s * c));
            }
        });
        Ok(Self { q: &problem.q, posed, a, c, g, preconditioned })
    }

    /// Adds G(|x| − u) to the defect.
    fn lag(&self, memory: &mut Memory, x: &[f64]) {
        let Memory { f, other, .. } = memory;
        let behind: Vec<_> = x.iter().zip(&*other).map(|(x, u)| x.abs() - u).collect();
        for (i, f) in f.iter_mut().enumerate() {
            *f += self.g.row(i).map(|(j, g)| g * behind[j]).sum::<f64>();
        }
    }

    fn precondition(&self, f: &mut [f64]) {
        for i in 0..f.len() - 1 {
            f[i] -= self.c.superdiagonal(i) * f[i + 1];
        }
    }

    /// Overwrites `y` with `x − ω (C + θD)⁻¹f`, and keeps the factors; NaN where it is singular.
    fn directly(&self, [theta, omega]: [f64; 2], memory: &mut Memory, x: &[f64], y: &mut [f64]) {
        let lu = memory.lu.get_or_insert_with(|| {
            let row = |i: usize, each: &mut dyn FnMut(usize, f64)| {
                self.c
                    .row(i)
                    .for_each(|(j, c)| each(j, if i == j { (1.0 + theta) * c } else { c }));
            };
            SparseLu::of(y.len(), row).expect("room for the factors")
        });
        lu.solve(&memory.f, y);
        y.iter_mut().for_each(|y| *y *= omega);
        descend(x, y);
    }
}

impl Assembled {
    /// Returns the entry right of the diagonal over that on it.
    fn superdiagonal(&self, i: usize) -> f64 {
        let next = self.row(i).find(|(j, _)| *j == i + 1);
        next.map_or(0.0, |(_, c)| c / self.diagonal[i])
    }

    /// Overwrites `y` with `x − M⁻¹f`, where `M` is the lower triangle, with its diagonal times a
    /// factor, of each of some diagonal blocks.
    fn forward(&self, factor: f64, blocks: usize, f: &[f64], x: &[f64], y: &mut [f64]) {
        let size = y.len().div_ceil(blocks);
        for i in 0..y.len() {
            let first = i - i % size;
            let known = self.row(i).take_while(|(j, _)| *j < i).filter(|(j, _)| *j >= first);
            let sum: f64 = known.map(|(j, c)| c * y[j]).sum();
            y[i] = (f[i] - sum) / (factor * self.diagonal[i]);
        }
        descend(x, y);
    }

    /// Overwrites `y` with `x − M⁻¹f`, where `M` is the upper triangle.
    fn backward(&self, f: &[f64], x: &[f64], y: &mut [f64]) {
        for i in (0..y.len()).rev() {
            let sum: f64 = self.row(i).filter(|(j, _)| *j > i).map(|(j, c)| c * y[j]).sum();
            y[i] = (f[i] - sum) / self.diagonal[i];
        }
        descend(x, y);
    }
}

struct Formula<'e, 'p> {
    equation: &'e Equation<'p>,
    method: &'static Published,
    parameter: f64,
    memory: Memory,
}

impl<'p> Method<f64> for Formula<'_, 'p> {
    type A = DynRows<'p, f64>;
    type B = DynRows<'p, f64>;

    fn problem(&self) -> &Hlcp<f64, Self::A, Self::B> {
        &self.equation.posed
    }

    fn step(&mut self, q: &Rhs<'_, f64>, x: &[f64], y: &mut Vec<f64>, _: &mut Clock<'_>) -> Norms {
        let Self { equation, method, parameter, memory } = self;
        memory.f.resize(x.len(), 0.0);
        equation.posed.defect(q.entries(), x, &mut memory.f, &mut memory.scratch);
        let norms = equation.posed.norms(&memory.f);
        if memory.before.is_empty() {
            memory.before.extend_from_slice(x);
            memory.other.extend(x.iter().map(|x| x.abs()));
            memory.t = 1.0;
        }
        (method.next)(equation, *parameter, memory, x, y);
        memory.sweeps += 1;
        memory.before.copy_from_slice(x);
        norms
    }

    fn work(&self) -> Option<Work> {
        Some(Work::sweeps(self.memory.sweeps))
    }

    fn restart(&mut self) {
        self.memory = Memory::default();
    }

    fn has_memory(&self) -> bool {
        true
    }
}

/// The library's methods beside these, with their parameters.
const OURS: [(&str, Parameter); 5] =
    [("MGS", NONE), ("AMGS", NONE), ("TMGS", NONE), ("AMSOR", ALPHAS), ("AUTO", NONE)];

/// The problems, whose MGS takes thousands of sweeps at most.
fn problems(quick: bool) -> Vec<Own> {
    let [m, disc, cells, film] = if quick { [16, 8, 12, 8] } else { [128, 32, 50, 24] };
    let [m, disc, cells, side] = [m, disc, cells, film].map(f64::from);
    let generic = |name, title| Own::scene(name, &[("m", m), ("solution", 1.0)], title);
    let disc_of = |name| Own::scene(name, &[("m", disc)], format!("{name}, m = {disc}"));
    let on_film = [("nx", side), ("ny", side), ("dimples", 2.0)];
    vec![
        generic("example1", format!("Example 1, m = {m}")),
        generic("example2", format!("Example 2, m = {m}")),
        disc_of("disc-lcp"),
        disc_of("disc-hlcp"),
        Own::scene("slider", &[("m", cells)], format!("slider, {cells} cells")),
        Own::scene("film", &on_film, format!("film, {side} × {side}")),
    ]
}

/// One of all that are compared, with its parameter on a problem, and τ.
#[derive(Clone, Copy)]
struct Rival {
    name: &'static str,
    /// The formula, unless it is a method of the library.
    published: Option<&'static Published>,
    /// The parameter's name and value.
    parameter: (&'static str, f64),
    tau: f64,
}

impl Rival {
    /// Returns all methods, each with all the parameters and τ that are tried.
    fn all() -> Vec<Vec<Self>> {
        let published = const { &METHODS }.iter().map(|of| (of.name, Some(of), of.parameter));
        let ours = OURS.into_iter().map(|(name, parameter)| (name, None, parameter));
        let tried = |(name, published, (letter, values)): (_, _, Parameter)| -> Vec<Self> {
            let taus = if name == "AUTO" { &TAUS[..1] } else { &TAUS };
            let rival = |value, tau| Self { name, published, parameter: (letter, value), tau };
            values.iter().flat_map(|&v| taus.iter().map(move |&tau| rival(v, tau))).collect()
        };
        published.chain(ours).map(tried).collect()
    }

    fn choice(&self) -> String {
        let (name, value) = self.parameter;
        let own = (!name.is_empty()).then(|| format!("{name} = {value}"));
        let tau = (self.tau != 1.0).then(|| format!("τ = {}", self.tau));
        let all: Vec<_> = own.into_iter().chain(tau).collect();
        if all.is_empty() { String::new() } else { format!(" ({})", all.join(", ")) }
    }
}

/// What is tried of τ.
const TAUS: [f64; 2] = [1.0, 0.5];

/// Returns the best of some rivals: that with the fewest sweeps.
fn best(rivals: Vec<Rival>, solve: impl Fn(&Rival) -> Fallible<Run>) -> Fallible<Rival> {
    let mut tried = vec![];
    for rival in rivals {
        let run = solve(&rival)?;
        tried.push((if run.converged() { run.outcome.sweeps } else { usize::MAX }, rival));
    }
    Ok(tried.into_iter().min_by_key(|(sweeps, _)| *sweeps).ok_or("no rival")?.1)
}

pub(crate) fn run(Arguments { quick, out }: &Arguments) -> Fallible<()> {
    /// Longer than any solve with the best parameters.
    const LONGEST: Duration = Duration::from_secs(2);
    let (iterations, repeats) = if *quick { (300, 1) } else { (20_000, 5) };
    let problems = problems(*quick);
    let head: String = problems.iter().map(|own| format!("|{}", own.title())).collect();
    // A row of each table for each method.
    let rows = Rival::all().into_iter().map(|of| [(); 2].map(|()| of[0].name.to_owned()));
    let mut rows: Vec<[String; 2]> = rows.collect();
    let bar = counting(problems.len() * rows.len());
    for own in &problems {
        let title = own.title();
        bar.set_message(title.clone());
        let judged = Judged::new(own.wide()?, "AMG", &own.limits(), false)?;
        let mut equations = vec![];
        for tau in TAUS {
            equations.push((tau, Equation::new(&judged.problem, tau)?));
        }
        let limits = to(1e-10, iterations, Some(LONGEST));
        let solve = |&Rival { name, published, parameter: (_, value), tau }: &Rival| {
            let Some(method) = published else {
                return Ok(solve(&judged.problem, &tuned(name, [value; 2])?, tau, &limits)?);
            };
            let (_, equation) = equations.iter().find(|(of, _)| *of == tau).ok_or("an equation")?;
            let memory = Memory::default();
            let formula = Formula { equation, method, parameter: value, memory };
            Ok(run::run(&judged.problem, &limits, || Ok(formula))?)
        };
        let mut rivals = vec![];
        for tried in Rival::all() {
            rivals.push(best(tried, solve)?);
            bar.inc(1);
        }
        let rule = Repeats { longest: 1.0, ..Repeats::least(repeats) };
        let runs = measure(rule, &rivals, |rival| solve(rival).map(Some))?;
        for ((rival, run), [sweeps, seconds]) in rivals.iter().zip(runs).zip(&mut rows) {
            let run = run.ok_or("a run")?;
            if !run.converged() {
                *sweeps += &format!("|{}", run.outcome.status);
                *seconds += "|–";
                continue;
            }
            let at = rival.choice();
            let error = judged.error(&run.answer);
            if error > 1e-4 {
                return Err(format!("{title}{at}: the answer is {error:e} off").into());
            }
            *sweeps += &format!("|{}{at}", run.outcome.sweeps);
            *seconds += &format!("|{:.3}", 1e3 * run.quartile(0));
        }
    }
    bar.finish_and_clear();
    let table = |what: &str, place: usize| {
        let mut table = Table::new(&format!("{what}{head}"));
        rows.iter().for_each(|row| table.row(&row[place]));
        table.markdown()
    };
    let mut sources = Table::new("method|step|source");
    for Published { name, source, formula, .. } in const { &METHODS } {
        sources.push([*name, *formula, *source].map(|cell| cell.replace('|', "\\|")).into());
    }
    let flag = if *quick { " --quick" } else { "" };
    let text = format!(
        "# The modulus literature in one table\n\nWritten by `cargo run --release -- modulus{flag}` ({}).\n\n\
         Published methods of the modulus family, each from its formula, beside the library's. From x⁰ = e (films 0) to ‖A z − B r + q‖₂ ≤ 10⁻¹⁰ ‖q‖₂. \
         A parameter and τ, which is 1 or ½, are the best of a list, by sweeps.\n\n## Sweeps\n\nOf the methods with an LU they are solves with its factors. AUTO counts the work of all it tries in sweeps.\n\n{}\n\
         ## Milliseconds\n\nThe least of {} solves, with the set-up. The published methods run in plain loops over rows, the library's in its own.\n\n{}\n\
         ## Formulas\n\nWritten for A z − B r + q = 0 with C = A + BΩ, G = BΩ − A, F(x) = C x − G|x| + γq, x⁻ the iterate before x, and M the lower triangle of C with its diagonal D.\n\n{}",
        machine(),
        table("sweeps", 0),
        repeats,
        table("ms", 1),
        sources.markdown(),
    );
    save(&out.join("modulus.md"), &text)?;
    print::line(format_args!("wrote the table to {}", printable(out.display())))?;
    Ok(())
}
