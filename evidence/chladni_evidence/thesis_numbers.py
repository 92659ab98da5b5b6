"""Tables of Echaniz Granado (2015) as printed; tables 4 to 6 are in ``chladni_bench``."""

TABLE_1 = {  # E [GPa], nu, rho [kg/m³], t [mm]
    "inner": (210, 0.3, 7850, 0.7),
    "outer upper": (210, 0.3, 7850, 0.7),
    "outer lower": (210, 0.3, 7850, 0.8),
    "upper reinforcements": (210, 0.3, 7850, 1.2),
    "lower reinforcements": (210, 0.3, 7850, 2.0),
    "latch reinforcement": (210, 0.3, 7850, 1.5),
    "wiper motor bracket": (210, 0.3, 7850, 1.5),
    "hem adhesive": (0.006, 0.4, 1000, None),
    "middle adhesive": (0.006, 0.4, 1000, None),
    "spot welds": (210, 0.3, None, None),
    "screws": (210, 0.3, 7850, None),
}  # the thesis has one row "adhesive" for both strings
QUOTIENT = 9.8087e6  # of the observability gramian, table 2
TABLE_2 = (248.43, 439.04, 470.72, 482.8, 675.89)  # condition at the best five shaker places
MODES_300 = 31  # below 300 Hz, section 4.1
MAPPED_MASS = (10.8654, 10.2223)  # [kg] before and after mapping, section 5.3.1
TABLE_7 = (2.286, 2.428)  # deviation: nominal, mapped thickness
TABLE_8 = {  # MAC of mode: nominal, mapped thickness
    1: (0.9975, 0.9974), 2: (0.9892, 0.9911), 3: (0.9886, 0.9906), 4: (0.7728, 0.7734),
    5: (0.9509, 0.9522), 6: (0.6778, 0.8591), 7: (0.0652, 0.2724), 8: (0.8120, 0.8189),
}  # fmt: skip
TABLE_9 = {  # MAC of mode: nominal adhesive, 210 GPa with nu 0.4, with nu 0.49
    1: (0.9974, 0.9981, 0.9981), 2: (0.9911, 0.9960, 0.9960), 3: (0.9906, 0.9912, 0.9912),
    4: (0.7734, 0.7672, 0.7666), 5: (0.9522, 0.9649, 0.9649), 6: (0.5194, 0.9791, 0.9791),
    7: (0.0458, 0.9169, 0.9172), 8: (0.8189, 0.9719, 0.9721), 9: (0.3312, 0.9590, 0.9594),
    10: (0.9695, 0.9893, 0.9897), 11: (0.3319, 0.8970, 0.8981), 12: (0.0082, 0.6302, 0.6302),
    13: (0.0025, 0.5578, 0.5576), 14: (0.1957, 0.3604, 0.3602),
}  # fmt: skip
TABLE_10 = (2.428, 1.321)  # deviation: mapped, stiff adhesive
TABLE_11 = {  # t [mm]: calibrated, nominal, mean of mapped
    "inner": (0.641, 0.7, 0.5901), "outer upper": (0.6481, 0.7, 0.6546),
    "outer lower": (0.7129, 0.8, 0.7485), "wiper motor bracket": (1.4399, 1.5, 1.488),
    "latch reinforcement": (1.4134, 1.5, 1.466), "upper reinforcements": (1.152, 1.2, 1.1518),
    "lower reinforcements": (1.9535, 2.0, None),
}  # fmt: skip
TABLE_12 = {  # nominal, calibrated; E [GPa], rho [kg/m³]; the thesis prints MPa for the welds
    "E": (210.0, 206.26), "rho": (7850.0, 7467.2), "weld patch": (210.0, 200.11),
    "deviation": (1.321, 1.146),
}  # fmt: skip
TABLE_13 = {"test": 10.513, "nominal": 10.82, "calibrated": 9.738}  # [kg]
TABLE_14 = (  # [Hz]: tailgate A, nominal, calibrated; None: no such mode
    (28.2, 24.9, 27.6), (56.1, 50.4, 54.9), (77.9, 78.4, 78.4), (None, 84.7, None),
    (91.3, 94.6, 93.5), (97.3, 114.2, 97.6), (118.1, 115.1, 121.0), (135.5, 131.4, 134.0),
    (142.1, 147.1, 143.4), (155.7, 153.2, 160.2), (159.4, 159.5, 169.3), (171.7, 179.9, 171.2),
    (181.1, 183.3, 187.1), (186.3, 191.7, 188.2), (191.6, 194.2, 193.1),
)  # fmt: skip
TABLE_15 = (2.2856, 1.146)  # deviation: nominal, calibrated
