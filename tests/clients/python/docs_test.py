"""docs/clients.md: every shell and Python example runs as it stands there, but for the service's port and the shell's path."""

import contextlib
import io
import os
import re
import subprocess
import sys

import support

DOCS = os.environ["PENUMBRA_DOCS"]


class Docs(support.FolderTest):
    def setUp(self):
        super().setUp()
        self.service = support.RealService(token="")
        self.addCleanup(self.service.stop)
        ran = support.run_penumbra("depth", os.path.join(DOCS, "../examples/square.json"), "--out", self.folder)
        self.assertEqual(ran.returncode, 0, ran.stderr)

    def blocks(self, language):
        with open(os.path.join(DOCS, "clients.md")) as file:
            found = re.findall(rf"^```{language}\n(.*?)^```", file.read(), re.S | re.M)
        for block in found:
            self.assertIn("http://127.0.0.1:8080", block)
        return [block.replace("http://127.0.0.1:8080", self.service.url) for block in found]

    def test_shell(self):
        expected = support.run_penumbra("mask", self.path("scene.json"), "-o", self.path("local.exr"))
        self.assertEqual(expected.returncode, 0)
        os.symlink(sys.executable, self.path("python3"))
        path = os.pathsep.join([self.folder, os.path.dirname(os.environ["PENUMBRA_CLI"]), os.environ["PATH"]])
        blocks = self.blocks("sh")
        self.assertEqual(len(blocks), 3)  # curl, command line, the module's command
        for block in blocks:
            ran = subprocess.run(["sh", "-eu", "-c", block], cwd=self.folder, env=dict(os.environ, PATH=path), capture_output=True, text=True, timeout=120)
            self.assertEqual(ran.returncode, 0, ran.stderr)
            compared = support.run_penumbra("compare", self.path("mask.exr"), self.path("local.exr"), "--json")
            self.assertIn('"max":0.0,', compared.stdout.replace(" ", "").replace("\n", "").replace('"max":0,', '"max":0.0,'))
            os.remove(self.path("mask.exr"))

    def test_python(self):
        block, = self.blocks("python")
        here, printed = os.getcwd(), io.StringIO()
        os.chdir(self.folder)
        try:
            with contextlib.redirect_stdout(printed):
                exec(compile(block, "clients.md", "exec"), {})
        finally:
            os.chdir(here)
        self.assertIn("(256, 256) ", printed.getvalue())
        self.assertIn("light.kind: ", printed.getvalue())
        self.assertEqual(self.read("mask.png")[:4], b"\x89PNG")
