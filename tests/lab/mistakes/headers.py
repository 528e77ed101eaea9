"""Headers of real recordings, retyped: the fields of pyMRAW's and pyidi's example files that say something.

The images are random, of the size and the bits that the header says.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from snapbeam.lab.photron import pack_12bit

_VIEWER = """
#Photron Fastcam Viewer Version Information (Resave):
Saved Date : 2018/12/20
Saved Time : 15:30
PFV.exe : 3.6.8.1
PDCLIB.dll : 2.7.0.0

#System Information:
OS : Windows 8 Enterprise (x64)   (version 6.2 Build 9200)
Memory : 16264MB RAM

END

#Photron Fastcam Viewer Version Information:
Saved Date : 2018/12/17
PFV.exe : 3.6.7.0

#Device 1 (Current):
Device Name : FASTCAM SA-Z type 2100K-M-64GB
Device ID : 011
Firmware : 1.07

END"""

_DETAILS = """AnalogBoard Channel Num : 0
Zero Frame : Exist
Edge Enhance : 0
Pre LUT Mode : DEF1
Pre LUT Gain : 1.0
Pre LUT Gamma : 1.00
Pre LUT PosiNega : Posi
DS Shutter : Value 0
Scale Method : 1
Scale Unit : 1
Scale Magnification : 1.0000
Scale Ruler : 1
Not Use : 
Not Use : 
Shading : On
Pixel Gain : Default
IRIG : Off
Partition 1 : 1789403(frame)
Signal Delay Trigger In(nsec) : 0
Locked Shutter Speed : Off
"""  # noqa: W291 - as the camera's program writes them

HEADERS = {
    # pyidi, data/data_showcase.cih
    "showcase.cih": """#Camera Information Header
Date : 2018/12/17
Time : 12:48
Camera Type : FASTCAM SA-Z type 2100K-M-64GB
Head Type : Unknown Child Device
Camera ID : 11
Scene Name : 
Trigger Time : 0
Record Rate(fps) : 15000
Shutter Speed(s) : 1/15371
Trigger Mode : Start
Original Total Frame : 15000
Total Frame : 75
Start Frame : 0
Correct Trigger Frame : 0
Save Step : 100
Image Width : 640
Image Height : 40
Color Type : Mono
Color Bit : 8
File Format : MRaw
EffectiveBit Depth : 12
EffectiveBit Side : Higher
Partition Number: 1
Digits Of File Number : 6
Device Last Error : -1:0xffffffff
Comment Text : 
Shutter Type2(nsec) : 65060
Scale Pixel Size : 47.1930
Scale Distance : 1000.0000
Scale 2Points Distance : 21.1896
"""  # noqa: W291
    + _DETAILS
    + _VIEWER,
    # pyMRAW, stikalo60k_16bit.cih
    "switch.cih": """#Camera Information Header
Date : 2016/4/21
Time : 00:11
Camera Type : FASTCAM SA-Z type 2100K-M-64GB
Record Rate(fps) : 60000
Shutter Speed(s) : 1/800000
Trigger Mode : Start
Original Total Frame : 677
Total Frame : 12
Start Frame : 49300
Correct Trigger Frame : 1
Save Step : 36
Image Width : 896
Image Height : 368
Color Type : Mono
Color Bit : 16
File Format : MRaw
EffectiveBit Depth : 12
EffectiveBit Side : Lower
Comment Text : first test
Shutter Type2(nsec) : 1250
Scale Grid Space : 10
Scale Pixel Size : 8.2148
Scale Distance : 600.0000
Scale 2Points Distance : 73.0392
"""
    + _DETAILS
    + _VIEWER,
    # pyidi, data/Speckle_beam_2k.cih, written by pyMRAW from a .cihx
    "beam_2k.cih": """#Camera Information Header
Record Rate(fps) : 10000.0
Shutter Speed(s) : 119149.0
Total Frame : 20
Original Total Frame : 621319
Start Frame : 0
Image Width : 980
Image Height : 39
Color Type : Mono
Color Bit : 8
File Format : Mraw
EffectiveBit Depth : 8
Comment Text : 
EffectiveBit Side : Lower
Date : 2020/11/10
Camera Type : FASTCAM SA-Z type 2100K-M-64GB
""",  # noqa: W291
    # pyidi, data/data_synthetic.cih
    "generated.cih": """#Camera Information Header
Record Rate(fps) : 1
Shutter Speed(s) : 1.000000
Total Frame : 10
Original Total Frame : 101
Start Frame : 0
Image Width : 256
Image Height : 128
Color Type : Mono
Color Bit : 16
File Format : MRaw
EffectiveBit Depth : 12
EffectiveBit Side : Lower
Comment Text : Generated sequence.<br>Modify measurement info in<br>created .cih file if necessary.
""",
    # the same as a folder of images, data/data_synthetic_img.cih
    "images.cih": """#Camera Information Header
Date : 2016/08/31
Camera Type : 1
Record Rate(fps) : 1
Shutter Speed(s) : 1.0
Total Frame : 10
Original Total Frame : 101
Start Frame : 0
Image Width : 256
Image Height : 128
Color Type : Mono
Color Bit : 16
File Format : PNG
EffectiveBit Depth : 12
EffectiveBit Side : Lower
Comment Text : Generated sequence.<br>Modify measurement info in<br>created .cih file if necessary.
""",
    # pyMRAW, data/beam.cihx
    "contradiction.cihx": """<cih>
    <fileInfo><date>2018/02/21</date></fileInfo>
    <frameInfo>
        <recordedFrame>400</recordedFrame>
        <totalFrame>4</totalFrame>
        <startFrame>0</startFrame>
        <correctTriggerFrame>0</correctTriggerFrame>
        <skipFrame>2500</skipFrame>
    </frameInfo>
    <deviceInfo><deviceName>FASTCAM</deviceName></deviceInfo>
    <recordInfo>
        <recordRate>50000</recordRate>
        <shutterSpeed>200000</shutterSpeed>
        <shutterSpeedNsec>5000</shutterSpeedNsec>
    </recordInfo>
    <imageDataInfo>
        <resolution><width>400</width><height>64</height></resolution>
        <colorInfo><type>Mono</type><bit>12</bit></colorInfo>
        <effectiveBit><depth>12</depth><side>Lower</side></effectiveBit>
    </imageDataInfo>
    <imageFileInfo><type>MRaw</type></imageFileInfo>
</cih>
""",
}


def value(header: str, name: str) -> str:
    """The first value of a field of a .cih header."""
    return next(line.partition(":")[2].strip() for line in header.splitlines() if line.startswith(name))


def images(count, height, width, bits, seed=0):
    """Random images."""
    kind = np.uint8 if bits <= 8 else np.uint16
    high = min(2**bits, 4096)
    return np.random.default_rng(seed).integers(0, high, (count, height, width)).astype(kind)


def with_pixels(folder: Path, name: str) -> Path:
    """Write a retyped header with random pixels beside it; its path."""
    path = folder / name
    header = HEADERS[name]
    path.write_bytes(header.encode())
    if name.endswith(".cihx"):
        path.with_suffix(".mraw").write_bytes(pack_12bit(images(4, 64, 400, 12).ravel()).tobytes())
        return path
    size = (int(value(header, one)) for one in ("Total Frame", "Image Height", "Image Width"))
    frames = images(*size, int(value(header, "Color Bit")))
    if value(header, "File Format") == "PNG":
        import cv2

        for k, frame in enumerate(frames):
            cv2.imwrite(str(folder / f"{path.stem}{k:06d}.png"), frame)
    else:
        path.with_suffix(".mraw").write_bytes(frames.tobytes())
    return path
