"""Shows the progress of a job in the title and the icon of the browser tab, and a notification when the job ends."""

from __future__ import annotations

import json
from pathlib import PurePath

from leafcut.studio.jobs.jobs import Jobs
from leafcut.studio.page.elements import box, text
from leafcut.studio.page.page_state import View


class Badge:
    """Sends the state of a job to badge.js. This is the page's own job, otherwise any other running job."""

    def __init__(self, view: View) -> None:
        self.view = view
        w = view.words
        #: The job that is shown. It remains visible after its end until another job starts.
        self._job: str | None = None
        self._sent = ""
        words = {key: w.table[f"badge.{key}"] for key in ("done", "failed", "cancelled", "interrupted", "blocked")}
        self.place = box("div", "hidden", id="badge", data_words=json.dumps(words, ensure_ascii=False))

    def tick(self) -> None:
        """Send the state if it has changed."""
        state = json.dumps(self._badge_data(), ensure_ascii=False)
        if state != self._sent:
            self._sent = state
            self.place.props["data-job"] = state
            self.place.update()

    def _badge_data(self) -> dict[str, object]:
        jobs = self.view.studio.jobs
        running = jobs.unfinished_ids()
        if self.view.job in running:
            self._job = self.view.job
        elif self._job not in running and running:
            self._job = running[0]
        if self._job is None:
            return {}
        return job_badge(jobs, self._job)


def job_badge(jobs: Jobs, job: str) -> dict[str, object]:
    """Return the data about a job for the browser tab. They are empty if the job was deleted."""
    live = jobs.find_live_job(job)
    if live is None:
        return {}
    name = PurePath(live.names[0]).stem if len(live.names) == 1 else ", ".join(live.names[:2])
    name = name.removeprefix("example:")
    share = round(100.0 * min(max(live.latest.share, 0.0), 1.0))
    return {"job": job, "name": name, "state": live.state.value, "share": 0 if live.state.is_over else share}


def add_notification_switch(view: View) -> None:
    """Add a switch for notifications at the end of each job."""
    with box("label", "notice"):
        box("input", "switch", type="checkbox", data_notice="")
        text("span", view.words("badge.notice"))
