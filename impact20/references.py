"""Write `references.toml`: `python -m impact20.references`."""

import tomli_w

from impact20 import FOLDER, closed_form, integrated, load, names


def references(name: str) -> dict[str, dict[str, float]]:
    """Compute value, relative error and conditioning of each quantity.

    The error is the difference of the two codes. The conditioning is the sum, over the real parameters, of the
    relative change of the exact value per relative change of the parameter by 1e-6.
    """
    parameters = load(name).parameters
    exact = getattr(closed_form, name)(**parameters)
    other = getattr(integrated, name)(**parameters)
    conditioning = dict.fromkeys(exact, 0.0)
    for key, number in parameters.items():
        if isinstance(number, float):
            changed = getattr(closed_form, name)(**{**parameters, key: number * (1 + 1e-6)})
            for q in exact:
                conditioning[q] += abs(changed[q] / exact[q] - 1) / 1e-6
    return {
        q: {
            "value": exact[q],
            "error": float(abs(other[q] / exact[q] - 1)),
            "conditioning": round(conditioning[q], 4),
        }
        for q in exact
    }


if __name__ == "__main__":
    table = {name: references(name) for name in names()}
    (FOLDER / "references.toml").write_text(tomli_w.dumps(table), encoding="utf-8")
