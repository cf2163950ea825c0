"""Loads what `raylign register -o DIR` left into 3D Slicer: the CT, put where the X-rays saw it, and the overlays.

A scripted module of one file: name its folder in Edit > Application Settings > Modules > Additional module paths. Untried in 3D
Slicer; `find_result`, which needs nothing of it, is tested.
"""

import json
import os
import shlex

try:
    import ctk
    import qt
    import slicer
    from slicer.ScriptedLoadableModule import ScriptedLoadableModule, ScriptedLoadableModuleLogic, ScriptedLoadableModuleWidget
except ImportError:  # outside of Slicer, where only find_result is used
    ScriptedLoadableModule = ScriptedLoadableModuleLogic = ScriptedLoadableModuleWidget = object


def find_result(folder):
    """What lies in the folder of a result: paths of the CT ("volume", None where it is elsewhere now), of its transform ("pose")
    and of the overlays, and whether the result is to be believed ("ok", "reasons"). OSError, ValueError: it is no such folder."""
    with open(os.path.join(folder, "report.json"), encoding="utf-8") as file:
        report = json.load(file)
    pose = os.path.join(folder, "pose.tfm")
    if not isinstance(report, dict) or "verdict" not in report or "outputs" not in report or not os.path.isfile(pose):
        raise ValueError(f"{folder}: not a folder that raylign register left")
    volume = volume_of(report)
    overlays = sorted(name for name in report["outputs"] if name.startswith("overlay_"))
    return {
        "volume": volume if volume is not None and os.path.exists(volume) else None,
        "pose": pose,
        "overlays": [os.path.join(folder, name) for name in overlays],
        "ok": report["verdict"]["ok"],
        "reasons": report["verdict"]["reasons"],
    }


def volume_of(report):
    """The CT that the command line named; None where it names none in a form known here."""
    words = shlex.split(report["command"])
    for word, after in zip(words, words[1:] + [None]):
        named = word[len("--volume=") :] if word.startswith("--volume=") else after if word in ("-v", "--volume") else None
        if named is not None:
            return os.path.join(report["working_directory"], named)
    return None


class RaylignResult(ScriptedLoadableModule):
    def __init__(self, parent):
        ScriptedLoadableModule.__init__(self, parent)
        parent.title = "Raylign result"
        parent.categories = ["Registration"]
        parent.contributors = ["The raylign developers"]
        parent.helpText = "Loads the folder that `raylign register -o DIR` left."


class RaylignResultWidget(ScriptedLoadableModuleWidget):
    def setup(self):
        ScriptedLoadableModuleWidget.setup(self)
        form = qt.QFormLayout()
        self.layout.addLayout(form)
        self.folder = ctk.ctkPathLineEdit()
        self.folder.filters = ctk.ctkPathLineEdit.Dirs
        form.addRow("Folder of the result:", self.folder)
        button = qt.QPushButton("Load")
        button.connect("clicked(bool)", self.load)
        form.addRow(button)
        self.layout.addStretch(1)

    def load(self, _checked=False):
        try:
            RaylignResultLogic().load(self.folder.currentPath)
        except (OSError, ValueError) as fault:
            slicer.util.errorDisplay(str(fault))


class RaylignResultLogic(ScriptedLoadableModuleLogic):
    def load(self, folder):
        """pose.tfm is ct_from_world as ITK writes it; read by Slicer it moves what stands under it from CT to world."""
        result = find_result(folder)
        transform = slicer.util.loadTransform(result["pose"])
        if result["volume"] is not None and os.path.isfile(result["volume"]):
            slicer.util.loadVolume(result["volume"]).SetAndObserveTransformNodeID(transform.GetID())
        else:
            slicer.util.infoDisplay("The CT is not where it was: load it, and put it under the transform by hand.")
        for overlay in result["overlays"]:
            slicer.util.loadVolume(overlay, {"singleFile": True, "show": False})
        if not result["ok"]:
            slicer.util.warningDisplay("The result is doubtful: " + "; ".join(result["reasons"]))
        return transform
