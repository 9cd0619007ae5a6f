"""The scene file's JSON Schema takes the scenes that there are, and no mistakes.

Environment, set by ctest: PENUMBRA_SCHEMA, scene.schema.json; PENUMBRA_SOURCE, the tree.
"""

import copy
import glob
import json
import os
import unittest

try:
    import jsonschema
except ImportError:
    jsonschema = None


@unittest.skipIf(jsonschema is None, "python3-jsonschema is not installed")
class SceneSchema(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with open(os.environ["PENUMBRA_SCHEMA"], encoding="utf-8") as file:
            schema = json.load(file)
        jsonschema.Draft202012Validator.check_schema(schema)
        cls.schema = schema
        cls.validator = jsonschema.Draft202012Validator(schema)
        cls.scenes = {}
        for folder in ("examples", "tests/fuzz/corpus/scene"):
            for path in glob.glob(os.path.join(os.environ["PENUMBRA_SOURCE"], folder, "*.json")):
                with open(path, encoding="utf-8") as file:
                    cls.scenes[path] = json.load(file)

    def test_every_scene_fits(self):
        self.assertGreaterEqual(len(self.scenes), 12)
        for path, scene in self.scenes.items():
            with self.subTest(path=path):
                self.assertEqual([f"{error.json_path}: {error.message}" for error in self.validator.iter_errors(scene)], [])

    def test_an_unknown_key_fits_nowhere(self):
        for path, scene in self.scenes.items():
            for place in objects_in(scene):
                with self.subTest(path=path, place=place):
                    wrong = copy.deepcopy(scene)
                    at(wrong, place)["no_key"] = 1
                    self.assertFalse(self.validator.is_valid(wrong))

    def test_every_example_of_a_key_fits(self):
        for name, definition in self.schema["$defs"].items():
            for form in definition.get("anyOf", [definition]):
                for key, schema in form["properties"].items():
                    values = schema.get("examples", []) + ([schema["default"]] if "default" in schema else [])
                    validator = jsonschema.Draft202012Validator({"$defs": self.schema["$defs"], **schema})
                    for value in values:
                        with self.subTest(name=name, key=key, value=value):
                            self.assertTrue(validator.is_valid(value))

    def test_a_scene_has_light_or_lights(self):
        light = {"kind": "point", "center": [0, 6, 0]}
        self.assertTrue(self.validator.is_valid({"penumbra": 1, "light": light}))
        self.assertTrue(self.validator.is_valid({"penumbra": 1, "lights": [light]}))
        self.assertFalse(self.validator.is_valid({"penumbra": 1}))
        self.assertFalse(self.validator.is_valid({"penumbra": 1, "light": light, "lights": [light]}))


def objects_in(value, place=()):
    if isinstance(value, dict):
        yield place
    for key, member in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from objects_in(member, place + (key,))


def at(value, place):
    for key in place:
        value = value[key]
    return value


if __name__ == "__main__":
    unittest.main()
