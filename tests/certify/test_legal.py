"""What a flow shows of itself."""

import numpy as np

import modegraph as mg


def two_modes(start: float) -> mg.ModeGraph:
    plant = mg.System(lambda x, u: np.array([u[0]]), states="level", inputs="flow")

    def mode(name: str, gain: float, radius: float) -> mg.Mode:
        return mg.Mode(
            name,
            plant,
            controller=lambda x, r: -gain * (x - r),
            reference=mg.setpoint([0.0]),
            start=mg.Ball([0.0], radius),
        )

    return mg.build([mode("slow", 1.0, start), mode("fast", 5.0, 0.25)], horizon=5.0)


def test_widths_are_those_of_the_reach_set() -> None:
    widths = two_modes(1.0).verdict("slow", "fast").widths
    assert widths is not None
    assert widths.states == ("level",)
    assert widths.times[0] == 0.0
    exact = 2.0 * np.exp(-widths.times)
    assert (widths.values[:, 0] >= exact * (1.0 - 1e-12)).all()
    assert (widths.values[:, 0] <= exact * (1.0 + 1e-6)).all()


def test_explain_shows_them() -> None:
    text = str(two_modes(1.0).explain("slow", "fast"))
    assert "width of the reach set over time" in text
    assert "level" in text.split("over time:")[1]
