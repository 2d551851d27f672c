"""Optuna: ask, tell, and prune what a stop condition ends."""

import optuna
import pytest

import maglev_cosim as maglev
from maglev_cosim.optuna import optimize

optuna.logging.set_verbosity(optuna.logging.WARNING)


@pytest.fixture
def shaken():
    """One magnet for 1 s, whose run ends where the gap is large."""
    return maglev.load("one-magnet").change(
        {
            "experiment": {"stop": 1},
            "objectives": {"gap_rms": {"signal": "vehicle.gap_rate_01", "figure": "rms"}},
            "stop_when": [{"name": "too far", "when": {"signal": "vehicle.gap_01", "above": 0.0080016}}],
        }
    )


def test_issue_bad_trials_are_pruned_and_good_ones_found(shaken):
    def suggest(trial, scenario):
        return scenario.set("ems_01.gain_gap_velocity", trial.suggest_float("gain", 0, 80))

    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=1, n_startup_trials=8))
    optimize(study, shaken, suggest, "gap_rms", trials=16)
    states = [trial.state for trial in study.trials]
    pruned = [trial for trial in study.trials if trial.state == optuna.trial.TrialState.PRUNED]
    assert len(states) == 16 and 1 <= len(pruned) < 12
    assert all("too far" in trial.user_attrs["ended_by"] for trial in pruned)
    # trials with little damping are the pruned ones, and the best one is a run of its own
    assert max(trial.params["gain"] for trial in pruned) < study.best_params["gain"]
    again = suggest(optuna.trial.FixedTrial(study.best_params), shaken).run()
    assert again.metrics["gap_rms"] == study.best_value
    assert optimize(study, shaken, suggest, lambda it: it.metrics["gap_rms"], trials=1).trials[-1].state.is_finished()


def test_refusal_unknown_figures_are_named(shaken):
    study = optuna.create_study()
    with pytest.raises(KeyError, match="it has: gap_rms"):
        optimize(study, shaken.times(stop=0.01), lambda trial, it: it, "gap", trials=1)
