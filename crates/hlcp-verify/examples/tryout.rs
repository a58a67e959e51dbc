//! Scratch.
use hlcp_core::{Hlcp, Omega};
use hlcp_methods::{Auto, Limits, Named, Parameters, Solver};
use hlcp_verify::families;
use std::time::{Duration, Instant};
fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let (methods, names) = (args[0].split(','), &args[1..]);
    let methods: Vec<&str> = methods.collect();
    let secs: f64 = std::env::var("SECS").ok().and_then(|s| s.parse().ok()).unwrap_or(20.0);
    for name in names {
        let (family, seeds) = name.split_once('-').unwrap();
        let (from, to) = seeds.split_once("..").unwrap_or((seeds, seeds));
        for seed in from.parse::<u64>().unwrap()..=to.parse().unwrap() {
            let drawn = families::draw(family, seed).unwrap();
            let ([a, b], q) = drawn.pose::<f64>();
            println!("{} n {} {}", drawn.name, q.len(), drawn.about);
            for method in &methods {
                let begin = Instant::now();
                let problem =
                    Hlcp::new(&a, &b, Omega::diagonal_ratio(1.0, &a, &b).unwrap()).unwrap();
                let limits = Limits {
                    time: Some(Duration::from_secs_f64(secs)),
                    rounding: Some(4.0),
                    ..Limits::default()
                };
                let setting = if *method == "AUTO" {
                    let mut solver = Solver::new(Auto::new(problem).unwrap());
                    let o = solver.solve(&q, limits).unwrap();
                    let turns: Vec<String> = solver
                        .method()
                        .history()
                        .iter()
                        .map(|t| format!("{} {} {:.0e}", t.choice, t.sweeps, t.residual))
                        .collect();
                    (o, turns.join("; "))
                } else {
                    let named = match Named::parse(method, Parameters::default())
                        .unwrap()
                        .on::<f64, _, _>(problem)
                    {
                        Ok(n) => n,
                        Err(e) => {
                            println!("   {method}: {e}");
                            continue;
                        }
                    };
                    let mut solver = Solver::new(named);
                    (solver.solve(&q, limits).unwrap(), String::new())
                };
                println!(
                    "   {method:8} {:9.4} s {:?} it {} sweeps {} rel {:.1e} | {}",
                    begin.elapsed().as_secs_f64(),
                    setting.0.status,
                    setting.0.iterations,
                    setting.0.sweeps,
                    setting.0.relative.l2,
                    setting.1
                );
            }
        }
    }
}
