"""Surveys that pages ask a server for. One thread only."""

from __future__ import annotations

from custom_interfaces.srv import ComputeSurvey
from drone_navigation.console.messages import PlanSurvey
from drone_navigation.console.page_types import Tell
from drone_navigation.console.requests import Answer, VehicleRequests
from drone_navigation.console.surveying.survey_messages import (
    survey_objection,
    survey_request,
    survey_route,
)

__all__ = ["ask_for_survey"]


def ask_for_survey(
    requests: VehicleRequests, asked: PlanSurvey, tell: Tell, answer: Answer
) -> None:
    """Ask the server for lines over an area; the page is told the route, or why there is none."""

    def take(response: ComputeSurvey.Response) -> None:
        objection = survey_objection(response)
        if objection:
            answer(False, objection)
        else:
            tell(survey_route(asked, response))

    def late() -> None:
        answer(False, "The server did not answer the request for a survey.")

    if requests.is_silent(answer):
        return
    request = survey_request(asked)
    if not requests.ask(ComputeSurvey, "compute_survey", request, take, late=late):
        answer(False, "The server of this vehicle does not compute surveys.")
