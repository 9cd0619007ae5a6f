"""Problems lead to the value that they are about."""

import email.message
import json
import unittest

import support  # noqa: F401 (hides numpy on request)
from penumbra_client import Unprocessable
from penumbra_client.transport import Answer, error_of


class Paths(unittest.TestCase):
    def test_the_path_of_a_problem(self):
        problem = {"detail": "light.half_u: is missing", "reason": "invalid_input", "path": "light.half_u"}
        error = error_of(Answer(422, email.message.Message(), json.dumps(problem).encode()))
        self.assertIsInstance(error, Unprocessable)
        self.assertEqual(error.path, "light.half_u")

    def test_no_path(self):
        self.assertEqual(error_of(Answer(422, email.message.Message(), b'{"detail": "no"}')).path, "")
