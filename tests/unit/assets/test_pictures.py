"""Images are decoded in a process of its own, which no image can hurt anything from."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator

import numpy as np
import pytest
from PIL import Image as Pillow

from meshcone.assets.content import Image
from meshcone.assets.pictures import Picture, PictureDecoder, UndecodableError, read_picture
from tests.painted import encoded, picture


@pytest.fixture(scope="module")
def decoder() -> Iterator[PictureDecoder]:
    with PictureDecoder() as made:
        yield made


def read(data: bytes) -> Picture:
    return read_picture(Image("a", "images/0", data))


def lying(width: int, height: int) -> bytes:
    """A small PNG whose header declares another size."""
    data = bytearray(encoded(picture(8, 8)))
    data[16:24] = struct.pack(">II", width, height)
    data[29:33] = struct.pack(">I", zlib.crc32(data[12:29]))
    return bytes(data)


@pytest.mark.parametrize("kind", ["PNG", "JPEG", "WEBP"])
def test_an_image_has_the_pixels_that_pillow_reads(kind: str, decoder: PictureDecoder) -> None:
    data = encoded(picture(), kind)

    found = decoder.pixels(read(data))

    assert (found == np.asarray(Pillow.open(io.BytesIO(data)).convert("RGBA"))).all()


@pytest.mark.parametrize("mode", ["P", "RGB", "RGBA", "LA", "L", "1"])
def test_every_kind_of_png_has_the_pixels_that_pillow_reads(
    mode: str, decoder: PictureDecoder
) -> None:
    see_through = {"P": 3, "RGB": (9, 9, 9)}
    image = Pillow.fromarray(picture(40, 200)).convert(mode)
    out = io.BytesIO()
    image.save(out, "PNG", **({"transparency": see_through[mode]} if mode in see_through else {}))

    found = decoder.pixels(read(out.getvalue()))

    assert (found == np.asarray(Pillow.open(out).convert("RGBA"))).all()


def test_a_large_progressive_photograph_fits_into_the_memory_it_is_given(
    decoder: PictureDecoder,
) -> None:
    rng = np.random.default_rng(1)
    data = encoded(rng.integers(0, 256, (2000, 2000, 3), dtype=np.uint8), "JPEG", progressive=True)

    assert decoder.pixels(read(data)).shape == (2000, 2000, 4)


def test_sixteen_bits_of_grey_are_cut_to_eight(decoder: PictureDecoder) -> None:
    grey = np.array([[0, 255, 256, 0x1234, 0xFFFF]], dtype=np.uint16)
    out = io.BytesIO()
    Pillow.fromarray(grey).save(out, "PNG")

    found = decoder.pixels(read(out.getvalue()))

    assert found[0, :, 0].tolist() == [0, 0, 1, 0x12, 0xFF]
    assert (found[..., 3] == 255).all()


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (lying(3000, 3000), "damaged"),
        (lying(16384, 8192), "more than the 67,108,864 texels"),
        (encoded(picture(), "JPEG")[:700], "damaged"),
        (encoded(picture(), "WEBP")[:90], "damaged"),
        (b"", "no PNG, JPEG, WebP or KTX2"),
    ],
    ids=["larger than it is", "larger than allowed", "short JPEG", "short WebP", "empty"],
)
def test_an_image_that_cannot_be_decoded_is_refused(
    data: bytes, why: str, decoder: PictureDecoder
) -> None:
    with pytest.raises(UndecodableError, match=why):
        decoder.pixels(read(data))


def ktx2(levels: int = 1, end: int = 150) -> bytes:
    """A KTX2 of 4 by 4 texels whose levels have 16 bytes each, up to some byte."""
    header = b"\xabKTX 20\xbb\r\n\x1a\n" + struct.pack("<9I", 37, 1, 4, 4, 0, 0, 1, levels, 0)
    described = struct.pack("<4I2Q", 104, 28, 0, 0, 0, 0)
    index = b"".join(struct.pack("<3Q", 132, 16, 16) for _ in range(levels))
    return (header + described + index + bytes(100))[:end]


@pytest.mark.parametrize(
    ("data", "fault"),
    [
        (ktx2(), None),
        (ktx2(end=28), "its header of 80 bytes is cut short"),
        (ktx2(end=90), "its list of levels ends at byte 104; the file has 90"),
        (ktx2(end=140), "level 0 ends at byte 148; the file has 140"),
        (ktx2(levels=40), "40 levels are more than its size has"),
    ],
    ids=["whole", "header", "levels", "texels", "too many levels"],
)
def test_a_ktx2_has_all_that_its_header_refers_to(data: bytes, fault: str | None) -> None:
    assert read(data).fault == (fault and f"damaged: {fault}")


def test_a_png_with_a_wrong_checksum_is_damaged(decoder: PictureDecoder) -> None:
    data = bytearray(encoded(picture()))
    data[-20] ^= 1

    with pytest.raises(UndecodableError) as caught:
        decoder.pixels(read(bytes(data)))

    assert caught.value.damaged


def test_an_image_that_is_only_too_large_is_not_damaged(decoder: PictureDecoder) -> None:
    with pytest.raises(UndecodableError) as caught:
        decoder.pixels(read(lying(16384, 8192)))

    assert not caught.value.damaged


def test_an_image_after_one_that_ended_the_process_is_decoded() -> None:
    with PictureDecoder() as decoder:
        decoder.pixels(read(encoded(picture())))
        assert decoder._process is not None
        decoder._process.kill()
        decoder._process.wait()
        with pytest.raises(UndecodableError, match="crashes the decoder"):
            decoder.pixels(read(encoded(picture())))

        assert decoder.pixels(read(encoded(picture()))).shape == (32, 64, 4)


def test_the_header_of_an_image_that_is_too_large_to_decode_is_read(
    decoder: PictureDecoder,
) -> None:
    most = Pillow.MAX_IMAGE_PIXELS

    found = read(lying(16_384, 16_384))

    assert (found.format, found.width, found.fault) == ("png", 16_384, None)
    assert most == Pillow.MAX_IMAGE_PIXELS
    with pytest.raises(UndecodableError, match="more than the 67,108,864 texels") as refusal:
        decoder.pixels(found)
    assert not refusal.value.damaged
