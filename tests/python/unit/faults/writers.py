"""Everything that writes a file: a name, how the file is called, and a function of its path."""

import numpy as np
from driver import commanded

import allanite as al


def writers(folder):
    rng = np.random.default_rng(4)
    log = folder / "log.npz"
    np.savez(log, data=rng.standard_normal((400, 2)), rate_hz=10.0, unit="deg/s")
    recording = al.read(log)
    one = al.Recording(recording.samples[:, 0], rate=10, unit="deg/s")
    fit, fits = al.parse_model("N").fit(one), al.parse_model("N").fit(recording)
    axes = al.characterize(recording, "N")
    curve, report = one.oadev(), al.characterize(one, "N").report()
    watch = al.Watch(fit.model, 10)
    watch.update(one.samples)
    model = folder / "model.json"
    fit.save(model)

    def command(*words):
        return lambda path: commanded([*words, path])[::2]

    simulated = ("simulate", "N(N=1)", "--rate", 10, "-n", 3000, "-o")
    adev = ("adev", log, "--plot")
    from allanite.effects.files import save_model
    from allanite.scale.logs import write_table

    rows = [{"file": "a", "N": 1.0}, {"file": "b", "N": 2.0}] * 300
    return {
        "fit": ("x.json", fit.save),
        "fits of columns": ("x.json", fits.save),
        "model": ("x.json", lambda path: save_model(fit.model, path)),
        "axes": ("x.json", axes.save),
        "summary": ("x.summary", al.summarize(one).save),
        "watch": ("x.json", watch.save),
        "table, text": ("x.csv", lambda path: write_table(rows, path)),
        "table, Parquet": ("x.parquet", lambda path: write_table(rows, path)),
        "figure, SVG": ("x.svg", lambda path: curve.plot(path) and None),
        "figure, PNG": ("x.png", lambda path: curve.plot(path) and None),
        "report, HTML": ("x.html", lambda path: report.save(path) and None),
        "report, Markdown": ("x.md", lambda path: report.save(path) and None),
        "samples, text": ("x.csv", command(*simulated)),
        "samples, NPY": ("x.npy", command(*simulated)),
        "samples, NPZ": ("x.npz", command(*simulated)),
        "export": ("x.yaml", command("export", model, "--format", "kalibr", "-o")),
        "command with a figure": ("x.svg", command(*adev)),
        "command with a fit": ("x.json", command("fit", log, "--model", "N", "--save")),
    }
