//! `hlcp film` in two dimensions: what is solved and written.

use std::{cell::RefCell, ops::ControlFlow, time::Instant};

use hlcp::{
    Limits, Named, Parameters, Progress,
    film::{
        Bearing, Coefficients, Film, FilmError, Idle, Map, Sensitivity, Settings, Solved, Threshold,
    },
    number,
};

use super::{
    Arguments, Done, NAMED, Numbers, balance, gap, motion, outputs, picture, report::Report,
};
use crate::{Fallible, progress::Way};

pub(super) fn solve(arguments: &Arguments) -> Fallible<Done> {
    let begun = Instant::now();
    if let Some(name) = &arguments.method {
        Named::parse(name, Parameters::default()).map_err(FilmError::from)?;
    }
    let way = RefCell::new(None);
    let watch = |name: &str, limits: &Limits, goal: f64, progress: &Progress<'_, f64>| {
        let mut way = way.borrow_mut();
        if progress.iteration == 0 {
            *way = Some(Way::new(name, goal, limits));
        }
        way.iter_mut().for_each(|way: &mut Way| way.show(progress));
        ControlFlow::Continue(())
    };
    let settings = Settings {
        method: arguments.method.as_deref(),
        in_parallel: arguments.threads.is_some_and(|threads| threads > 1),
        watch: Some(&watch),
    };
    let mut bearing = gap::posed(arguments)?;
    if arguments.motion.is_none() || arguments.load.is_some() {
        let film = bearing.here().expect("the position has been checked");
        refuse_idle(&bearing, &film, arguments)?;
    }
    let ratios = whirls(&bearing, arguments)?;
    let mut ends = vec![".svg", "-pressure.csv", "-pressure.npy", "-content.csv", "-content.npy"];
    ends.extend(arguments.motion.as_ref().map(|_| "-motion.csv"));
    let outputs = outputs(arguments, &ends)?;
    let (mut steps, mut last, mut warnings) = (None, None, vec![]);
    let (solved, solves, converged) = if let Some(path) = &arguments.motion {
        if arguments.load.is_some() {
            balance::equilibrium(&mut bearing, arguments, &settings)?;
        }
        let run = motion::run(path, bearing, arguments, &settings)?;
        bearing = run.bearing;
        steps = Some((run.csv, run.imbalance));
        last = Some(run.figures);
        warnings.extend(run.doubt);
        (run.solved, run.steps, run.all_converged)
    } else {
        let (solved, solves) = balance::equilibrium(&mut bearing, arguments, &settings)?;
        let converged = solved.outcome.converged();
        (solved, solves, converged)
    };
    let both = || -> Result<_, FilmError> {
        let own = Coefficients::new(&bearing, &solved)?;
        Ok([own, Coefficients::clamped(&bearing, &solved, &settings)?])
    };
    let coefficients = (arguments.coefficients && converged).then(both).transpose()?;
    let whirl = (!ratios.is_empty() && converged)
        .then(|| Whirl::of(&bearing, &solved, ratios))
        .transpose()?;
    let sensitivities = (arguments.sensitivities && converged)
        .then(|| sensitivities(&bearing, &solved, arguments))
        .transpose()?;
    let certificate = arguments.certify.then(|| solved.certificate()).transpose()?;
    let Solved { film, z, r, .. } = &solved;
    let range = arguments.data_tolerance.filter(|_| converged);
    let range = range.map(|part| bearing.range(part, film, z, r)).transpose()?;
    let of_end = || film.figures(z, r, bearing.ambient);
    let figures = match last {
        // Flows are means over the last step, but what is proved is of its end.
        Some(mut figures) if certificate.is_some() => {
            let end = of_end();
            (figures.sides, figures.leaks, figures.supplies) = (end.sides, end.leaks, end.supplies);
            figures
        }
        last => last.unwrap_or_else(of_end),
    };
    let load = bearing.load(film, &figures, z);
    let oil = arguments.oil.unwrap_or_default();
    let derived = bearing.derived(film, &figures, load[0], &oil);
    let report = Report {
        bearing: &bearing,
        figures,
        load,
        derived,
        oil,
        proved: (certificate.iter().flatten().next())
            .map(|certificate| bearing.proved(&solved.film, certificate)),
        solved: &solved,
        solves,
        converged,
        coefficients,
        whirl,
        sensitivities,
        certificate,
        range,
        run_imbalance: steps.as_ref().map(|(_, imbalance)| *imbalance),
        seconds: begun.elapsed().as_secs_f64(),
    };

    let [_, x, y] = load;
    let map = |values| Map { columns: film.nx, rows: film.ny, values };
    let (pressures, contents) = (map(film.pressures(z)), map(r.iter().map(|r| 1.0 - r).collect()));
    let mut texts = vec![
        picture::drawn(&bearing, &solved, [x, y], arguments, &report.caption()).into_bytes(),
        pressures.csv(),
        pressures.npy(),
        contents.csv(),
        contents.npy(),
    ];
    texts.extend(steps.map(|(csv, ..)| csv.into_bytes()));
    warnings.extend(NAMED.warnings(film, &report.figures, Some(&derived), converged));
    Ok(Done {
        outputs,
        texts,
        json: report.json(),
        report: report.text(arguments),
        warnings,
        converged,
    })
}

/// The frequencies of --whirl over the running speed.
fn whirls(bearing: &Bearing, arguments: &Arguments) -> Result<Vec<f64>, String> {
    let Some(Numbers(ratios)) = &arguments.whirl else { return Ok(vec![]) };
    if let Some(ratio) = ratios.iter().find(|&&ratio| ratio < 0.0) {
        return Err(format!(
            "--whirl has {ratio}, but a frequency over the running speed is 0 or more"
        ));
    }
    if bearing.running_speed() == 0.0 {
        return Err("--whirl has frequencies over the running speed, but nothing runs; give \
                    --rpm or --speed, or take --motion"
            .into());
    }
    Ok(ratios.clone())
}

/// Coefficients at frequencies.
pub(super) struct Whirl {
    /// The frequency over the running speed, and those at it.
    pub(super) at: Vec<(f64, Coefficients)>,
    /// Of a journal, if there is one.
    pub(super) threshold: Option<Threshold>,
}

impl Whirl {
    fn of(bearing: &Bearing, solved: &Solved, ratios: Vec<f64>) -> Result<Self, FilmError> {
        let running = bearing.running_speed();
        let at = |ratio| Ok((ratio, Coefficients::at(bearing, solved, ratio * running)?));
        let at = ratios.into_iter().map(at).collect::<Result<_, FilmError>>()?;
        Ok(Self { at, threshold: Threshold::of(bearing, solved)? })
    }
}

/// The name and the unit of a number, and what figures gain with it.
pub(super) type Slopes = (String, &'static str, Sensitivity);

fn sensitivities(
    bearing: &Bearing,
    solved: &Solved,
    arguments: &Arguments,
) -> Fallible<Vec<Slopes>> {
    let named = gap::parameters(bearing, arguments).into_iter();
    let (names, parameters): (Vec<_>, Vec<_>) =
        named.map(|(name, unit, parameter)| ((name, unit), parameter)).unzip();
    let load = balance::load(bearing, arguments)?;
    let found = bearing.sensitivities(solved, &parameters, load.as_ref())?;
    Ok(names.into_iter().zip(found).map(|((name, unit), found)| (name, unit, found)).collect())
}

/// Refuses a film in which nothing happens, and questions to one that runs dry.
fn refuse_idle(bearing: &Bearing, film: &Film, arguments: &Arguments) -> Fallible<()> {
    match Idle::of(film) {
        Some(Idle::Closed) => return Err("nothing drives the film: the walls carry nothing and nothing enters or leaves, so any even pressure is a solution; give --speed, --motion or a pressure by --side or --supply".into()),
        Some(Idle::Even(pressure)) => {
            let speed = if bearing.journal.is_some() { "--rpm" } else { "--speed" };
            return Err(format!("nothing drives the film: the walls are at rest and all pressures are {} Pa, so that is the pressure everywhere; give {speed} or --motion", number(pressure)).into());
        }
        None => {}
    }
    let (option, what) = match &arguments.load {
        Some(load) => ("load", format!("carries nothing instead of {} N", number(load.0[0]))),
        None if arguments.coefficients => ("coefficients", "answers to no motion".into()),
        None if arguments.whirl.is_some() => ("whirl", "answers to no motion".into()),
        None if arguments.sensitivities => ("sensitivities", "changes with nothing".into()),
        None => return Ok(()),
    };
    if film.is_fed() {
        return Ok(());
    }
    let is_still = film.speeds.iter().sum::<f64>() == 0.0;
    let what = if arguments.load.is_none() && is_still { "no derivatives" } else { &*what };
    let is_journal = bearing.journal.is_some();
    Err(format!("--{option}: {}", NAMED.unfed(film, is_journal, &format!(" and {what}"))).into())
}
