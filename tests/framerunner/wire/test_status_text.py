"""STATUSTEXT: texts of real drones, and invalid ones."""

from pymavlink.dialects.v20 import common as mavlink

from framerunner.wire.status_text import TextAssembler, plain


def said(text, *, number=0, place=0, severity=6):
    return mavlink.MAVLink_statustext_message(severity, text, number, place)


def take(assembler, *messages, component=1, now_s=0.0):
    return [text.text for message in messages for text in assembler.take(message, component, now_s)]


def test_a_short_text_is_whole_at_once_and_markup_stays_text():
    assert take(TextAssembler(), said(b"<b>hello</b> & so\t")) == ["<b>hello</b> & so"]


def test_pieces_are_joined_in_order():
    first, second = said(b"a" * 50, number=7, place=0), said(b"b" * 50, number=7, place=1)
    assembler = TextAssembler()
    assert take(assembler, second, first) == []
    assert take(assembler, said(b"end", number=7, place=2)) == ["a" * 50 + "b" * 50 + "end"]


def test_a_lost_piece_is_marked_and_a_lost_end_is_not_waited_for_forever():
    assembler = TextAssembler()
    assert take(assembler, said(b"a" * 50, number=7), said(b"end", number=7, place=2)) == ["a" * 50 + "…end"]
    assert take(assembler, said(b"c" * 50, number=8)) == []
    assert [text.text for text in assembler.expire(5.0)] == ["c" * 50]
    assert assembler.expire(9.0) == []


def test_texts_of_two_components_are_not_mixed():
    assembler = TextAssembler()
    take(assembler, said(b"a" * 50, number=7), component=1)
    assert take(assembler, said(b"b", number=7, place=1), component=191) == ["…b"]


def test_memory_is_bounded():
    assembler = TextAssembler()
    texts = [
        text
        for number in range(1, 400)
        for text in take(assembler, said(b"x" * 50, number=number, place=number % 256))
    ]
    assert len(assembler._incomplete) <= 4
    assert max(map(len, texts)) <= 500


def test_what_is_no_text_is_made_one():
    assert plain(b"a\x1b[31m\xffz\0rest") == "a [31m\ufffdz"
    assert plain(b"\n\t ") == ""
    assert len(plain("y" * 9000)) == 500
    assert take(TextAssembler(), said(b"\n")) == []
