"""What 3D Slicer would meet: the XML of `register --xml` against the rules of its command-line modules, and the scripted module's
reading of a result that the program wrote. Neither runs in 3D Slicer here.   slicer_test.py PROGRAM SOURCES WORK"""

import json
import os
import py_compile
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

program, sources, work = sys.argv[1:]

# Rules: https://www.slicer.org/wiki/Documentation/Nightly/Developers/SlicerExecutionModel#XML_Schema
HEAD = ["category", "title", "description", "version", "documentation-url", "license", "contributor", "acknowledgements"]
OF_PARAMETER = ["name", "flag", "longflag", "label", "description", "default", "element", "constraints", "channel"]
ATTRIBUTES = {
    "boolean": set(), "string": set(), "integer": set(), "double": set(), "string-enumeration": set(),
    "file": {"fileExtensions", "multiple"}, "directory": {"multiple"}, "image": {"type", "multiple", "fileExtensions"},
}


def in_order(tags, order):
    return all(tag in order for tag in tags) and [order.index(tag) for tag in tags] == sorted(order.index(tag) for tag in tags)


def fault_of_parameter(parameter):
    """The first rule that it breaks, or none."""
    if parameter.tag not in ATTRIBUTES:
        return "type"
    if not set(parameter.attrib) <= ATTRIBUTES[parameter.tag]:
        return "attributes"
    tags = [child.tag for child in parameter]
    if not in_order(tags, OF_PARAMETER) or any(tags.count(tag) > 1 for tag in tags if tag != "element"):
        return "order"
    text = {child.tag: (child.text or "").strip() for child in parameter}
    if not all(text.get(tag) for tag in ("name", "longflag", "label", "description")):
        return "missing"
    if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", text["name"]) or not re.fullmatch(r"--[a-z0-9-]+", text["longflag"]):
        return "name"
    if not re.fullmatch(r"-[A-Za-z]", text.get("flag", "-x")):
        return "flag"
    needs_channel = parameter.tag in ("file", "directory", "image")
    if needs_channel != ("channel" in text) or text.get("channel", "input") not in ("input", "output"):
        return "channel"
    if parameter.tag == "boolean" and text.get("default") not in ("true", "false"):
        return "default"
    if parameter.tag in ("integer", "double") and not re.fullmatch(r"-?[0-9.]+", text.get("default", "")):
        return "default"
    elements = [child.text for child in parameter.findall("element")]
    if (parameter.tag == "string-enumeration") != bool(elements) or len(set(elements)) != len(elements):
        return "elements"
    if elements and text.get("default") not in elements:
        return "default"
    return None


def fault_of(module):
    if module.tag != "executable" or not in_order([child.tag for child in module], [*HEAD, "parameters"]):
        return "head"
    if any(not (module.findtext(tag) or "").strip() for tag in ("category", "title", "description")):
        return "head"
    names = []
    for group in module.findall("parameters"):
        if [child.tag for child in group][:2] != ["label", "description"] or len(group) < 3:
            return "group"
        for parameter in group[2:]:
            fault = fault_of_parameter(parameter)
            if fault:
                return f"{fault} of {parameter.findtext('longflag')}"
            names.append(parameter.findtext("longflag"))
    return None if len(set(names)) == len(names) and names else "names"


def run(*arguments):
    done = subprocess.run([program, *arguments], capture_output=True, text=True, cwd=work)
    assert done.returncode == 0, (arguments, done.stderr)
    return done.stdout


shutil.rmtree(work, ignore_errors=True)
os.makedirs(work)
text = run("register", "--xml")
assert text.startswith("<?xml"), text[:80]  # Slicer wants nothing before it
assert fault_of(ElementTree.fromstring(text)) is None, fault_of(ElementTree.fromstring(text))
options = set(re.findall(r"<longflag>(.*?)</longflag>", text))
assert {"--volume", "--views", "--start", "--output", "--method"} <= options
assert options <= set(re.findall(r"--[a-z0-9-]+", run("register", "--help")))
for broken, fault in (("<default>false</default>", "default"), ("<channel>output</channel>", "channel"), ("<label>Volume</label>", "missing"),
                      ("<element>bobyqa</element>", "")):  # the checker finds what it is for
    assert broken in text, broken
    changed = text.replace(broken, "<element>auto</element>" if not fault else "", 1)
    assert (fault_of(ElementTree.fromstring(changed)) or "").startswith(fault or "elements"), broken

# A result, as the module reads it.
case = os.path.join(sources, "tests/package/case")
for name in ("views.json", "truth.json", "start.json"):
    shutil.copy(os.path.join(case, name), work)
run("phantom", "spine", "--size", "32", "--spacing", "6,6,6", "-o", "spine.mha")
run("drr", "-v", "spine.mha", "--attenuation", "--views", "views.json", "--pose", "truth.json", "-o", "xrays")
# As Slicer calls it: by the long names of the XML, with every value that it shows.
wrapper = os.path.join(sources, "apps/slicer/raylign_register")
shown = []
for parameter in ElementTree.fromstring(text).iter():
    if parameter.tag in ("string-enumeration", "integer"):
        shown += [parameter.findtext("longflag"), parameter.findtext("default")]
given = ["--volume", "spine.mha", "--attenuation", "--views", "xrays/views.json", "--start", "truth.json", "--output", "result"]
done = subprocess.run([wrapper, *given, *shown], cwd=work, env={**os.environ, "RAYLIGN": program}, capture_output=True, text=True)
assert done.returncode in (0, 1), done.stderr  # 1: doubtful, of such a small phantom
py_compile.compile(os.path.join(sources, "apps/slicer/RaylignResult.py"), cfile=os.path.join(work, "module.pyc"), doraise=True)
sys.path.insert(0, os.path.join(sources, "apps/slicer"))
sys.dont_write_bytecode = True
import RaylignResult  # noqa: E402

found = RaylignResult.find_result(os.path.join(work, "result"))
assert found["volume"] == os.path.join(work, "spine.mha"), found
assert os.path.isfile(found["pose"]) and all(os.path.isfile(path) for path in found["overlays"]), found
assert [os.path.basename(path) for path in found["overlays"]] == ["overlay_AP.png", "overlay_LAT.png"], found
assert isinstance(found["ok"], bool) and isinstance(found["reasons"], list)
for command, volume in (("raylign register --volume='a b.mha' -o x", "/w/a b.mha"), ("raylign register -o x", None), ("raylign register -v /ct.mha", "/ct.mha")):
    assert RaylignResult.volume_of({"command": command, "working_directory": "/w"}) == volume
with open(os.path.join(work, "xrays/report.json"), "w", encoding="utf-8") as file:
    json.dump({"raylign": "0.2.0"}, file)
try:
    RaylignResult.find_result(os.path.join(work, "xrays"))
    raise SystemExit("a folder without a result was taken for one")
except ValueError:
    pass
print("as 3D Slicer wants it")
