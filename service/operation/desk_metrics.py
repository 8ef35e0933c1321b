"""What is looked up at every scrape: the queue of work, the model, what was dropped, audits, jobs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Protocol

import numpy as np
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from service.audit.auditor import Auditor
from service.audit.tally import LARGEST_LOG
from service.rest.active_model import ActiveModel
from service.rest.limits import WorkQueue
from training.served_answers import ServedAnswers


class JobCounts(Protocol):
    """Whoever runs jobs."""

    def counts(self) -> Mapping[tuple[str, str], int]:
        """How many jobs there are of each (kind, state), by all replicas together."""
        ...


class DeskMetrics(Collector):
    """The state of a running service, as metrics.

    Parameters
    ----------
    draining
        Whether the service is about to stop.
    jobs
        None where no jobs are run.
    """

    def __init__(
        self,
        model: ActiveModel,
        work: WorkQueue,
        kept: ServedAnswers | None,
        auditor: Auditor | None,
        draining: Callable[[], bool],
        jobs: JobCounts | None = None,
    ) -> None:
        self._model, self._work, self._kept = model, work, kept
        self._auditor, self._draining, self._jobs = auditor, draining, jobs

    def describe(self) -> Iterable[Metric]:
        """Nothing: what there is shows at the first scrape."""
        return ()

    def collect(self) -> Iterable[Metric]:
        """The state now."""
        yield from self._of_work()
        yield from self._of_model()
        if self._kept is not None:
            dropped = self._kept.dropped
            yield CounterMetricFamily(
                "rubscreen_exact_answers_dropped", "Exact answers not kept for retraining.", dropped
            )
        if self._auditor is not None:
            yield from _of_audit(self._auditor, self._model.now.model_id)
        if self._jobs is not None:
            family = GaugeMetricFamily("rubscreen_jobs", "Jobs of all replicas.", labels=("kind", "state"))
            for labels, count in self._jobs.counts().items():
                family.add_metric(labels, count)
            yield family

    def _of_work(self) -> Iterable[Metric]:
        yield GaugeMetricFamily("rubscreen_work_running", "Requests being computed.", self._work.running)
        yield GaugeMetricFamily(
            "rubscreen_work_waiting", "Requests waiting for a thread.", self._work.waiting
        )
        yield GaugeMetricFamily("rubscreen_work_threads", "Requests computed at once.", self._work.threads)
        yield GaugeMetricFamily(
            "rubscreen_draining", "1 when the service is about to stop.", self._draining()
        )

    def _of_model(self) -> Iterable[Metric]:
        info = GaugeMetricFamily("rubscreen_model_info", "The model that answers.", labels=("model",))
        info.add_metric((self._model.now.model_id or "none",), 1)
        yield info
        yield CounterMetricFamily(
            "rubscreen_model_switches", "Models taken up while running.", self._model.switches
        )
        yield CounterMetricFamily(
            "rubscreen_model_refusals", "Models named active and not taken up.", self._model.refusals
        )
        fault = float(self._model.fault is not None)
        yield GaugeMetricFamily(
            "rubscreen_model_fault", "1 when the model named active does not answer.", fault
        )


def _of_audit(auditor: Auditor, model: str | None) -> Iterable[Metric]:
    names = ("model", "contact", "alpha")
    answers = CounterMetricFamily(
        "rubscreen_audit_answers",
        "Confident answers held to the exact core by this replica.",
        labels=(*names, "answered", "found"),
    )
    false_stable = CounterMetricFamily(
        "rubscreen_audit_false_stable", "Of these, called stable and unstable.", labels=names
    )
    for promise, tally in list(auditor.counted.items()):
        labels = (promise.model, promise.contact, f"{promise.alpha:g}")
        right, wrong = tally.answered_stable - tally.false_stable, tally.false_stable
        answers.add_metric((*labels, "stable", "stable"), right)
        answers.add_metric((*labels, "stable", "unstable"), wrong)
        answers.add_metric((*labels, "unstable", "stable"), tally.false_unstable)
        right = tally.answered_unstable - tally.false_unstable
        answers.add_metric((*labels, "unstable", "unstable"), right)
        answers.add_metric((*labels, "either", "undecided"), tally.undecided)
        false_stable.add_metric(labels, wrong)
    evidence = GaugeMetricFamily(
        "rubscreen_audit_evidence",
        "Against the certified rate, from all replicas since the model's first audit; 100 raises the alarm.",
        labels=names,
    )
    alarm = GaugeMetricFamily(
        "rubscreen_audit_alarm", "1 once the certified rate was contradicted.", labels=names
    )
    for promise, seen in auditor.known.items():
        if promise.model == model:  # of others it is history, and in the database
            labels = (promise.model, promise.contact, f"{promise.alpha:g}")
            evidence.add_metric(
                labels, float(np.exp(min(seen.tally.log_evidence(promise.alpha), LARGEST_LOG)))
            )
            alarm.add_metric(labels, float(seen.alarmed_at is not None))
    passed_over = CounterMetricFamily(
        "rubscreen_audit_passed_over", "Answers drawn and not audited.", auditor.passed_over
    )
    return answers, false_stable, evidence, alarm, passed_over
