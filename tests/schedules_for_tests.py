"""Schedules of one's own, good and bad."""

from bindusbl_des import View


def all_at_once(view: View) -> list[list[int]]:
    return [list(range(len(view.auvs)))]


def each_alone(view: View) -> list[list[int]]:
    return [[auv] for auv in range(len(view.auvs))]


def no_groups(view: View) -> list[list[int]]:
    return []


def twice(view: View) -> list[list[int]]:
    return [[0], [0]]


def stranger(view: View) -> list[list[int]]:
    return [[0, 7]]


def broken(view: View) -> list[list[int]]:
    return [[view.auvs["AUV0"]]]


def nothing(view: View) -> None:
    return None
