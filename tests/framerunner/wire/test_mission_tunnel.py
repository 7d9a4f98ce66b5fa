"""A mission's reports are decoded as encoded, and invalid bytes are refused."""

import json
import struct
import zlib
from dataclasses import replace
from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from framerunner.wire.mission_tunnel import (
    MAX_DOCUMENT_BYTES,
    MAX_PIECES,
    PIECE_BYTES,
    UNSEEN,
    DocumentAssembler,
    DocumentKind,
    MissionDetections,
    MissionState,
    PayloadError,
    decode_detections,
    decode_state,
    encode_detections,
    encode_state,
    split_document,
)

MISSION, HISTORY, RESULT = DocumentKind.MISSION, DocumentKind.HISTORY, DocumentKind.RESULT
TUNNEL_BYTES = 128

numbers = st.floats(width=32, allow_nan=False)
fours = st.tuples(numbers, numbers, numbers, numbers)
boxes = st.tuples(*[numbers] * 6)
times = st.integers(0, 2**63 - 1)
states = st.builds(
    MissionState,
    mission_crc=st.integers(0, 2**32 - 1),
    state_index=st.integers(-1, 2**15 - 1),
    transitions=st.integers(0, 2**16 - 1),
    time_us=times,
    entered_us=times,
    flying=st.booleans(),
    paused=st.booleans(),
    finished=st.booleans(),
    command=fours,
    pose_arena=fours,
)
detections = st.builds(
    MissionDetections,
    time_us=st.none() | times,
    width_px=st.integers(0, 2**16 - 1),
    height_px=st.integers(0, 2**16 - 1),
    red=boxes,
    green=boxes,
    blue=boxes,
)
json_values = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**53), 2**53)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(codec="utf-8")),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(st.characters(codec="utf-8")), inner),
    max_leaves=12,
)
objects = st.dictionaries(st.text(st.characters(codec="utf-8")), json_values, max_size=6)
kinds = st.sampled_from(DocumentKind)
STATE = MissionState(7, 3, 2, 10, 5, True, False, False, (0.0,) * 4, (0.0,) * 4)


def joined(assembler, pieces):
    """The documents that an assembler makes of pieces."""
    return [document for piece in pieces if (document := assembler.take(piece)) is not None]


def piece(packed, kind=MISSION, crc=None, index=0, count=1, version=1):
    crc = zlib.crc32(packed) if crc is None else crc
    return struct.pack("<BBIBB", version, kind, crc, index, count) + packed


def incompressible(count):
    """An object whose JSON cannot be compressed well."""
    state, letters = 1, []
    for _ in range(count):
        state = state * 6364136223846793005 % 2**64 + 1442695040888963407 & 2**64 - 1
        letters.append(chr(33 + (state >> 40) % 90))
    return {"noise": "".join(letters)}


@given(states)
def test_a_state_is_decoded_as_encoded(state):
    payload = encode_state(state)
    assert len(payload) <= TUNNEL_BYTES
    assert decode_state(payload) == state


@given(detections)
def test_detections_come_back(seen):
    payload = encode_detections(seen)
    assert len(payload) <= TUNNEL_BYTES
    assert decode_detections(payload) == seen


def test_an_unseen_box_is_decoded_as_unseen():
    back = decode_detections(encode_detections(MissionDetections(None, 320, 240)))
    assert (back.red, back.time_us) == (UNSEEN, None)


def test_the_bytes_are_those_of_the_documented_layout():
    state = replace(STATE, paused=True, command=(1.0, 2.0, 3.0, 4.0), pose_arena=(5.0, 6.0, 7.0, 8.0))
    assert encode_state(state) == struct.pack("<BBIhHQQ8f", 1, 3, 7, 3, 2, 10, 5, 1, 2, 3, 4, 5, 6, 7, 8)
    seen = MissionDetections(None, 320, 240)
    assert encode_detections(seen)[:13] == struct.pack("<BHHq", 1, 320, 240, -1)
    crc, (only,) = split_document(HISTORY, {"transitions": []})
    assert only[:8] == struct.pack("<BBIBB", 1, 2, crc, 0, 1)
    assert json.loads(zlib.decompress(only[8:])) == {"transitions": []}
    assert zlib.crc32(only[8:]) == crc


def test_transitions_are_counted_modulo_65536():
    assert decode_state(encode_state(replace(STATE, transitions=65_537))).transitions == 1


@pytest.mark.parametrize(
    "change",
    [{"state_index": 40_000}, {"time_us": -1}, {"mission_crc": 2**32}, {"command": (1e39, 0.0, 0.0, 0.0)}],
)
def test_a_value_without_room_is_refused(change):
    with pytest.raises(PayloadError, match="state: a value does not fit its field"):
        encode_state(replace(STATE, **change))


@given(kinds, objects)
def test_a_document_is_returned_once(kind, content):
    crc, pieces = split_document(kind, content)
    assert all(len(payload) <= PIECE_BYTES + 8 for payload in pieces)
    assembler = DocumentAssembler()
    (document,) = joined(assembler, pieces)
    assert (document.kind, document.crc, document.content) == (kind, crc, content)
    assert joined(assembler, pieces * 2) == []  # repeated for those who came late


@given(
    st.lists(objects, min_size=len(DocumentKind), max_size=len(DocumentKind)),
    st.randoms(use_true_random=False),
)
def test_pieces_of_several_documents_may_be_mixed_and_repeated(contents, random):
    pieces = [piece for kind, item in zip(DocumentKind, contents, strict=True) for piece in split(kind, item)]
    pieces *= 2
    random.shuffle(pieces)
    documents = joined(DocumentAssembler(), pieces)
    assert {document.kind: document.content for document in documents} == dict(
        zip(DocumentKind, contents, strict=True)
    )
    assert len(documents) == len(DocumentKind)


def split(kind, content):
    return split_document(kind, content)[1]


def test_numbers_that_json_does_not_have_become_null():
    (document,) = joined(
        DocumentAssembler(), split(HISTORY, {"values": [["d", inf], ["a", nan], ("b", 1.5)]})
    )
    assert document.content == {"values": [["d", None], ["a", None], ["b", 1.5]]}


def test_half_a_character_becomes_a_question_mark():
    (document,) = joined(DocumentAssembler(), split(MISSION, {"name": "a\ud800b"}))
    assert document.content == {"name": "a?b"}


def test_a_newer_document_drops_the_half_received_one():
    assembler = DocumentAssembler()
    old, new = split(MISSION, incompressible(400)), split(MISSION, incompressible(500))
    assert joined(assembler, old[:-1]) == []
    assert [document.content for document in joined(assembler, new)] == [incompressible(500)]
    assert joined(assembler, old[-1:]) == []  # its others are forgotten
    assert [document.content for document in joined(assembler, old)] == [incompressible(400)]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"text": "x" * MAX_DOCUMENT_BYTES}, f"1000011 bytes; the limit is {MAX_DOCUMENT_BYTES}"),
        (incompressible(60_000), f"pieces; the limit is {MAX_PIECES}"),
        ({"value": object()}, "cannot be written as JSON"),
    ],
)
def test_an_invalid_document_is_refused_in_one_line(content, words):
    with pytest.raises(PayloadError, match=words) as caught:
        split_document(RESULT, content)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("result document: ")


@pytest.mark.parametrize(
    ("payload", "words"),
    [
        (b"", "piece of a document: 0 bytes"),
        (piece(b"x", version=2), "version 2; this program reads 1"),
        (piece(b"x", kind=9), "kind 9 is not known"),
        (piece(b"x", index=1), "index 1 of 1"),
        (piece(b"x", index=0, count=0), "index 0 of 0"),
        (piece(b""), "8 bytes; 9 to 126 expected"),
        (piece(b"x" * 119), "127 bytes; 9 to 126 expected"),
        (piece(b"x", crc=1), "its CRC is wrong"),
        (piece(b"no zlib"), "cannot be decompressed"),
        (piece(zlib.compress(b"{}")[:-1]), "cannot be decompressed"),
        (piece(zlib.compress(b"{}") + b"more"), "cannot be decompressed"),
        (piece(zlib.compress(b"[]")), "is no JSON object"),
        (piece(zlib.compress(b"{")), "is no JSON"),
        (piece(zlib.compress(b"\xff")), "is no JSON"),
        (piece(zlib.compress(b'{"a": NaN}')), "is no JSON"),
        (piece(zlib.compress(b'{"a": 1e999}')), "is no JSON"),
        (piece(zlib.compress(b'{"a": "\\ud800"}')), "is no JSON"),
        (piece(zlib.compress(b'{"a":' * 5000)), "is no JSON"),
    ],
)
def test_a_damaged_piece_is_refused_in_one_line(payload, words):
    with pytest.raises(PayloadError, match=words) as caught:
        DocumentAssembler().take(payload)
    assert "\n" not in str(caught.value)


def test_a_document_that_inflates_without_end_is_refused():
    packed = zlib.compress(b"[" + b" " * 20_000_000)  # 20 MB in 20 kB
    parts = [packed[start : start + PIECE_BYTES] for start in range(0, len(packed), PIECE_BYTES)]
    crc = zlib.crc32(packed)
    pieces = [piece(part, MISSION, crc, index, len(parts)) for index, part in enumerate(parts)]
    assembler = DocumentAssembler()
    with pytest.raises(PayloadError, match=f"mission document: more than {MAX_DOCUMENT_BYTES} bytes"):
        joined(assembler, pieces)
    assert joined(assembler, pieces) == []  # it is not tried again with every repetition


def test_a_damaged_document_is_received_when_it_is_repeated():
    assembler = DocumentAssembler()
    pieces = split(RESULT, incompressible(400))
    spoilt = pieces[0][:-1] + bytes([pieces[0][-1] ^ 1])
    with pytest.raises(PayloadError, match="CRC is wrong"):
        joined(assembler, [spoilt, *pieces[1:]])
    assert [document.content for document in joined(assembler, pieces)] == [incompressible(400)]


@pytest.mark.parametrize("decode", [decode_state, decode_detections])
def test_another_version_or_length_is_refused(decode):
    with pytest.raises(PayloadError, match="version 2; this program reads 1, update the older one"):
        decode(bytes([2]) * 90)
    for payload in (b"", b"\1", bytes([1]) * 57, bytes([1]) * 86):
        with pytest.raises(PayloadError, match=r"bytes; .* expected"):
            decode(payload)


@given(st.lists(st.binary(max_size=140), max_size=20))
def test_any_bytes_raise_nothing_else(payloads):
    assembler = DocumentAssembler()
    for payload in payloads:
        for read in (decode_state, decode_detections, assembler.take):
            for bytes_read in (payload, b"\1" + payload):
                try:
                    read(bytes_read)
                except PayloadError:
                    continue


@given(objects, st.data())
def test_a_flipped_bit_never_gives_another_document(content, data):
    pieces = split(MISSION, content)
    number = data.draw(st.integers(0, len(pieces) - 1))
    bit = data.draw(st.integers(0, 8 * len(pieces[number]) - 1))
    spoilt = bytearray(pieces[number])
    spoilt[bit // 8] ^= 1 << bit % 8
    assembler = DocumentAssembler()
    for payload in [*pieces[:number], bytes(spoilt), *pieces[number + 1 :]]:
        try:
            document = assembler.take(payload)
        except PayloadError:
            continue
        assert document is None or document.content == content
