"""Arrays to and from portable float maps."""

import math
import struct
import unittest
from array import array

import support
from penumbra_client.images import check_part_name, decode_pfm, encode_image, numpy

ROWS = [[1.0, 2.0, 3.0], [4.0, 5.5, math.inf]]
# Written out by hand: rows stand bottom up.
BYTES = b"Pf\n3 2\n-1.0\n" + struct.pack("<6f", 4, 5.5, math.inf, 1, 2, 3)


class Encode(unittest.TestCase):
    def test_lists_and_arrays(self):
        self.assertEqual(encode_image(ROWS), BYTES)
        self.assertEqual(encode_image((array("f", [1, 2, 3, 4, 5.5, math.inf]), (2, 3))), BYTES)
        self.assertEqual(encode_image([[1]]), b"Pf\n1 1\n-1.0\n" + struct.pack("<f", 1))
        self.assertEqual(encode_image([[[1, 2, 3]], [[4, 5, 6]]]), b"PF\n1 2\n-1.0\n" + struct.pack("<6f", 4, 5, 6, 1, 2, 3))

    def test_nan_and_negative_go_as_they_are(self):
        self.assertEqual(encode_image([[-1.0, math.nan]])[-8:], struct.pack("<2f", -1, math.nan))

    def test_bytes_go_as_they_are(self):
        self.assertEqual(encode_image(b"anything"), b"anything")
        self.assertEqual(encode_image(bytearray(b"anything")), b"anything")

    def test_refusals(self):
        for image in ([], [[]], [1.0, 2.0], [[1.0], [1.0, 2.0]], [[[1, 2]]], [[[1, 2, 3], [1, 2]]], [[1e39]], [[-1e300]], b"",
                      (array("f", [1, 2, 3]), (2, 2)), (array("f"), (0, 0)), (array("f", [1]), (1,))):
            with self.subTest(image=image), self.assertRaisesRegex(ValueError, "^image x: "):
                encode_image(image, "x")
        for image in (None, 3, {}, [["1"]], [[None]], (array("d", [1]), (1, 1))):
            with self.subTest(image=image), self.assertRaisesRegex(TypeError, "^image x: "):
                encode_image(image, "x")

    def test_the_largest_float32_passes(self):
        largest = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]
        self.assertEqual(encode_image([[largest]])[-4:], b"\xff\xff\x7f\x7f")


class Decode(unittest.TestCase):
    def pixels(self, data):
        pixels, shape = decode_pfm(data)
        self.assertEqual(type(pixels).__name__, "array" if support.HIDE_NUMPY else "ndarray")
        if not support.HIDE_NUMPY:
            self.assertEqual(pixels.shape, shape)
            self.assertEqual(pixels.dtype, "float32")
            self.assertTrue(pixels.flags.c_contiguous and pixels.flags.writeable)
            pixels = pixels.ravel()
        return list(pixels), shape

    def test_round_trip(self):
        self.assertEqual(self.pixels(BYTES), ([1, 2, 3, 4, 5.5, math.inf], (2, 3)))
        self.assertEqual(self.pixels(encode_image([[[1, 2, 3]], [[4, 5, 6]]])), ([1, 2, 3, 4, 5, 6], (2, 1, 3)))

    def test_big_endian(self):
        self.assertEqual(self.pixels(b"Pf\n1 2\n1.0\n" + struct.pack(">2f", 2, 1)), ([1, 2], (2, 1)))

    def test_garbage(self):
        for data in (b"", b"P", b"Pf\n", b"P5\n1 1\n1\n\0", b"Pf\n1 1\n-1.0\n\0\0\0", BYTES + b"\0", BYTES[:-1], b"Pf\n0 1\n-1.0\n",
                     b"Pf\n1 1\n0\n\0\0\0\0", b"Pf\n1 1\n--\n\0\0\0\0", b"Pf\n1 1\n1e999\n\0\0\0\0", b"Pf\n-1 1\n-1\n\0\0\0\0",
                     b"Pf\n99999999999 1\n-1\n", b"<html></html>"):
            with self.subTest(data=data), self.assertRaises(ValueError):
                decode_pfm(data)


class Names(unittest.TestCase):
    def test_names(self):
        for name in ("a", "_a.b-C9.exr", "a" * 128):
            check_part_name(name)
        for name in ("", ".a", "a/b", "a b", "scene", "a" * 129, "a\n", 'a"', "ä", 3):
            with self.subTest(name=name), self.assertRaises(ValueError):
                check_part_name(name)


@unittest.skipIf(support.HIDE_NUMPY, "without numpy there are no numpy arrays")
class Numpy(unittest.TestCase):
    def test_arrays(self):
        image = numpy.array(ROWS, numpy.float32)
        self.assertEqual(encode_image(image), BYTES)
        self.assertEqual(encode_image(image.astype(numpy.float64)), BYTES)
        self.assertEqual(encode_image(image.astype(">f4")), BYTES)
        self.assertEqual(encode_image(numpy.asfortranarray(image)), BYTES)
        self.assertEqual(encode_image(numpy.repeat(image, 2, axis=1)[:, ::2]), BYTES)

    def test_refusals(self):
        for kind in (numpy.uint16, numpy.int64, bool, complex):
            with self.assertRaisesRegex(TypeError, "floating point"):
                encode_image(numpy.ones((2, 2), kind))
        for image in (numpy.ones(3), numpy.ones((2, 2, 1)), numpy.ones((0, 2)), numpy.full((1, 1), 1e39)):
            with self.assertRaises(ValueError):
                encode_image(image)


class Hidden(unittest.TestCase):
    def test_numpy_is_there_or_hidden(self):
        self.assertEqual(numpy is None, support.HIDE_NUMPY)  # else the other half of these tests would not have run


if __name__ == "__main__":
    unittest.main()
