"""Optuna: searches for good values with ask and tell, and prunes what a stop condition ends.

    import optuna
    from maglev_cosim.optuna import optimize

    def suggest(trial, scenario):
        return scenario.set("ems_*.gain_gap", trial.suggest_float("gain", 2, 14))

    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=1))
    optimize(study, scenario, suggest, "gap_rms", trials=30)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import optuna

from ._errors import RunError
from .results import Results
from .scenario import Scenario

#: Names of figures of the scenario, or a function of the results.
Objective = str | Sequence[str] | Callable[[Results], float | Sequence[float]]


def optimize(
    study: optuna.Study,
    scenario: Scenario,
    suggest: Callable[[optuna.Trial, Scenario], Scenario],
    objective: Objective,
    *,
    trials: int,
) -> optuna.Study:
    """Asks the study for trials, runs a scenario for each, and tells the study how it ended.

    `suggest` makes the scenario of a trial. `objective` is the name of a figure of the scenario's objectives or limits, a
    list of them, or a function of the results. A run that a stop condition or a unit ends early is pruned, and one that
    fails has failed; both have the reason as user attribute `ended_by`.
    """
    for _ in range(trials):
        trial = study.ask()
        try:
            results = suggest(trial, scenario).run()
        except RunError as error:
            trial.set_user_attr("ended_by", str(error))
            study.tell(trial, state=optuna.trial.TrialState.FAIL)
            continue
        if results.status != "finished":
            trial.set_user_attr("ended_by", results.ended_by)
            study.tell(trial, state=optuna.trial.TrialState.PRUNED)
            continue
        study.tell(trial, _values(results, objective))
    return study


def _values(results: Results, objective: Objective) -> float | Sequence[float]:
    if callable(objective):
        return objective(results)
    names = [objective] if isinstance(objective, str) else list(objective)
    values = []
    for name in names:
        if name not in results.metrics:
            known = ", ".join(results.metrics) or "none"
            raise KeyError(f'the scenario has no figure "{name}"; it has: {known}')
        value = results.metrics[name]
        if value is None:
            reason = next(it["reason"] for it in results.verdicts if it["name"] == name)
            raise ValueError(f'the figure "{name}" is not known: {reason}')
        values.append(value)
    return values
