"""Writes one small surface in the dialects of VTK XML PolyData that Sidewall must read. Run in this folder."""

import base64
import struct
import zlib

# Two pieces: a quadrilateral and a triangle; a strip of two triangles and a triangle.
PIECES = [
    dict(points=[(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 2, 0.1)], strips=[], polys=[(0, 1, 2, 3), (3, 2, 4)],
         height=[0.0, 1.5, -2.25, 3.0, 1e-3], material=[7, 9], rate=[0.5, 1.5, 2.5, 3.5]),
    dict(points=[(2, 0, 0), (3, 0, 0), (2, 1, 0), (3, 1, 0), (4, 4, 4)], strips=[(0, 1, 2, 3)], polys=[(1, 4, 3)],
         height=[5.0, 6.0, 7.0, 8.0, 9.0], material=[-1, 3], rate=[4.5, 5.5, 6.5, 7.5]),
]
CODES = dict(Int8="b", UInt8="B", Int16="h", UInt16="H", Int32="i", UInt32="I", Int64="q", UInt64="Q", Float32="f",
             Float64="d")


class Writer:
    def __init__(self, encoding, order="<", header="UInt32", compressed=False, point="Float64", index="Int64"):
        self.encoding, self.order, self.header, self.compressed = encoding, order, header, compressed
        self.point, self.index, self.appended = point, index, b""

    def pack(self, kind, values):
        return struct.pack(self.order + str(len(values)) + CODES[kind], *values)

    def encode(self, raw, base64_text):
        """Header and data as VTK lays them out; a compressed header is a base64 stream of its own."""
        if not self.compressed:
            whole = self.pack(self.header, [len(raw)]) + raw
            return base64.b64encode(whole) if base64_text else whole
        block = 16
        blocks = [zlib.compress(raw[i:i + block]) for i in range(0, len(raw), block)]
        head = self.pack(self.header, [len(blocks), block, len(raw) % block] + [len(b) for b in blocks])
        if base64_text:
            return base64.b64encode(head) + base64.b64encode(b"".join(blocks))
        return head + b"".join(blocks)

    def array(self, name, kind, values, components=1):
        start = f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" '
        if self.encoding == "ascii":
            return start + 'format="ascii">\n  ' + " ".join(repr(v) for v in values) + "\n</DataArray>\n"
        raw = self.pack(kind, values)
        if self.encoding == "inline":
            return start + 'format="binary">\n  ' + self.encode(raw, True).decode() + "\n</DataArray>\n"
        offset = len(self.appended)
        self.appended += self.encode(raw, self.encoding == "appended-base64")
        return start + f'format="appended" offset="{offset}"/>\n'

    def cells(self, tag, cells):
        ends = [sum(map(len, cells[:i + 1])) for i in range(len(cells))]
        flat = [v for cell in cells for v in cell]
        return f"<{tag}>\n" + self.array("connectivity", self.index, flat) + self.array("offsets", self.index,
                                                                                         ends) + f"</{tag}>\n"

    def file(self):
        compressor = ' compressor="vtkZLibDataCompressor"' if self.compressed else ""
        endian = "LittleEndian" if self.order == "<" else "BigEndian"
        xml = (f'<?xml version="1.0"?>\n<VTKFile type="PolyData" version="1.0" byte_order="{endian}" '
               f'header_type="{self.header}"{compressor}>\n<PolyData>\n')
        for p in PIECES:
            xml += (f'<Piece NumberOfPoints="{len(p["points"])}" NumberOfVerts="0" NumberOfLines="0" '
                    f'NumberOfStrips="{len(p["strips"])}" NumberOfPolys="{len(p["polys"])}">\n')
            xml += '<PointData Scalars="height">\n' + self.array("height", "Float64", p["height"]) + "</PointData>\n"
            xml += "<CellData>\n" + self.array("material", "Int16", p["material"])
            xml += self.array("rate", "Float32", p["rate"], 2) + "</CellData>\n"
            xml += "<Points>\n" + self.array("Points", self.point, [x for q in p["points"] for x in map(float, q)],
                                              3) + "</Points>\n"
            xml += self.cells("Strips", p["strips"]) + self.cells("Polys", p["polys"]) + "</Piece>\n"
        xml += "</PolyData>\n"
        if self.encoding.startswith("appended"):
            kind = "base64" if self.encoding == "appended-base64" else "raw"
            return xml.encode() + f'<AppendedData encoding="{kind}">\n_'.encode() + self.appended + \
                b"\n</AppendedData>\n</VTKFile>\n"
        return (xml + "</VTKFile>\n").encode()


FILES = {
    "ascii": Writer("ascii"),
    "inline": Writer("inline"),
    "inline_zlib_uint64": Writer("inline", header="UInt64", compressed=True),
    "inline_big_endian": Writer("inline", order=">", index="UInt32"),
    "appended_raw": Writer("appended-raw", index="Int32"),
    "appended_raw_zlib": Writer("appended-raw", compressed=True, header="UInt64"),
    "appended_raw_zlib_big_endian": Writer("appended-raw", order=">", compressed=True, index="UInt8"),
    "appended_base64": Writer("appended-base64", header="UInt64", index="UInt64"),
    "appended_base64_zlib": Writer("appended-base64", compressed=True, index="Int16"),
}
for name, writer in FILES.items():
    with open(name + ".vtp", "wb") as out:
        out.write(writer.file())
