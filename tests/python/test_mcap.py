"""Reads our MCAP files with the public reader (PyPI mcap)."""

import io
import json
import random
import struct
from collections import Counter

import pytest
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader, SeekingReader
from mcap.records import Chunk, MessageIndex
from mcap.stream_reader import CRCValidationError, StreamReader

from sample import write_sample

SECOND = 1_000_000_000
DURATION = 11
RATES = {
    "/operator_sample": 90,
    "/target": 20,
    "/reference": 20,
    "/plan": 20,
    "/plan_step": 20,
    "/joint_command": 500,
    "/joint_state": 500,
}
SCHEMAS = {
    "/operator_sample": "foxglove.PoseInFrame",
    "/target": "foxglove.PoseInFrame",
    "/reference": "foxglove.PosesInFrame",
    "/plan": "foxglove.PosesInFrame",
    "/plan_step": "steadyhand.PlanStep",
    "/joint_command": "steadyhand.JointCommand",
    "/joint_state": "steadyhand.JointState",
}


@pytest.fixture(scope="module")
def content(tmp_path_factory) -> bytes:
    return (write_sample(tmp_path_factory.mktemp("mcap")) / "sample.mcap").read_bytes()


def seeking(content: bytes) -> SeekingReader:
    return SeekingReader(io.BytesIO(content), validate_crcs=True)


def test_every_message_is_there_and_in_order(content):
    counts, sequences = Counter(), {}
    last = 0
    for schema, channel, message in seeking(content).iter_messages():
        assert message.log_time >= last
        assert message.publish_time <= message.log_time
        assert message.sequence == sequences.get(channel.topic, 0)
        sequences[channel.topic] = message.sequence + 1
        last = message.log_time
        counts[channel.topic] += 1
        assert schema.name == SCHEMAS[channel.topic]
    assert counts == {topic: rate * DURATION for topic, rate in RATES.items()}


def test_summary_agrees_with_what_is_streamed(content):
    summary = seeking(content).get_summary()
    statistics = summary.statistics
    streamed = list(NonSeekingReader(io.BytesIO(content), validate_crcs=True).iter_messages(log_time_order=False))
    counts = Counter(channel.id for _, channel, _ in streamed)
    assert statistics.message_count == len(streamed)
    assert statistics.channel_message_counts == counts
    assert statistics.message_start_time == min(m.log_time for _, _, m in streamed)
    assert statistics.message_end_time == max(m.log_time for _, _, m in streamed)
    assert statistics.chunk_count == len(summary.chunk_indexes) > 10
    assert statistics.metadata_count == 1
    assert {c.topic: summary.schemas[c.schema_id].name for c in summary.channels.values()} == SCHEMAS


def test_seeking_finds_what_filtering_finds(content):
    everything = [(c.topic, m.log_time, m.data) for _, c, m in seeking(content).iter_messages()]
    generator = random.Random(1)
    for _ in range(20):
        begin, end = sorted(generator.randrange(0, DURATION * SECOND) for _ in range(2))
        topics = generator.sample(sorted(RATES), 2)
        found = [
            (c.topic, m.log_time, m.data)
            for _, c, m in seeking(content).iter_messages(topics=topics, starting_at=begin, ending_before=end)
        ]
        assert sorted(found) == sorted(e for e in everything if e[0] in topics and begin <= e[1] < end)


def test_messages_are_json_that_their_schemas_know(content):
    for schema, channel, message in seeking(content).iter_messages():
        assert schema.encoding == "jsonschema" and channel.message_encoding == "json"
        properties = json.loads(schema.data)["properties"]
        value = json.loads(message.data)
        assert set(value) <= set(properties)
        assert {"timestamp"} <= set(value)
        if channel.topic == "/target":
            assert abs(sum(x * x for x in value["pose"]["orientation"].values()) - 1) < 1e-12


def test_metadata_tells_the_run(content):
    (metadata,) = seeking(content).iter_metadata()
    assert metadata.name == "run"
    assert "demo-recording" in metadata.metadata["recording"]


def messages_per_chunk(content: bytes) -> list[int]:
    counts = []
    for record in StreamReader(io.BytesIO(content), emit_chunks=True).records:
        if isinstance(record, Chunk):
            counts.append(0)
        elif isinstance(record, MessageIndex):
            counts[-1] += len(record.records)
    return counts


def test_a_file_cut_anywhere_gives_all_its_complete_chunks(content):
    chunks = seeking(content).get_summary().chunk_indexes
    assert max(c.message_end_time - c.message_start_time for c in chunks) <= SECOND // 2
    in_chunk = messages_per_chunk(content)

    generator = random.Random(2)
    cuts = [generator.randrange(8, len(content)) for _ in range(40)]
    cuts += [chunks[3].chunk_start_offset + chunks[3].chunk_length + by for by in (-1, 0, 1)]
    for cut in cuts:
        complete = [i for i, c in enumerate(chunks) if c.chunk_start_offset + c.chunk_length <= cut]
        found = 0
        try:
            reader = NonSeekingReader(io.BytesIO(content[:cut]), validate_crcs=True)
            for _ in reader.iter_messages(log_time_order=False):
                found += 1
        except (McapError, struct.error):
            pass  # how this reader says that the file ends too early, after all that can be read
        assert found == sum(in_chunk[i] for i in complete), f"cut at {cut}"


def test_a_changed_byte_is_noticed(content):
    chunk = seeking(content).get_summary().chunk_indexes[2]
    broken = bytearray(content)
    broken[chunk.chunk_start_offset + 9 + 24] ^= 1  # the chunk's own checksum
    with pytest.raises(CRCValidationError):
        list(seeking(bytes(broken)).iter_messages())
    broken = bytearray(content)
    broken[30] ^= 1  # in the header, so only the data section's checksum can tell
    with pytest.raises(CRCValidationError):
        list(NonSeekingReader(io.BytesIO(bytes(broken)), validate_crcs=True).iter_messages())
