"""The names of quantities and conditions in laboratories, in English, German, French, Italian, Spanish and Dutch."""

from __future__ import annotations

from collections.abc import Mapping

NAMES_OF: Mapping[str, tuple[str, ...]] = {
    "time": (
        *("timestamp", "time stamp", "datetime", "date time", "date/time", "date and time", "clock", "zeit", "elapsed"),
        *("elapsed time", "unix", "unix time", "epoch", "epoch time", "uhrzeit", "zeitstempel", "test time", "時間"),
        *("time of day", "time elapsed", "creep time", "time under load", "prüfzeit", "laufzeit", "belastungszeit"),
        *("datum und uhrzeit", "datum uhrzeit", "datum/uhrzeit", "datum zeit", "date et heure", "date heure"),
        *("beanspruchungsdauer", "versuchszeit", "temps", "durée", "temps écoulé", "x_value", "tempo"),
        *("tempo di prova", "tempo trascorso", "ora", "tiempo", "tiempo de ensayo", "tiempo transcurrido", "hora"),
        *("tijd", "proeftijd", "belastingstijd", "verstreken tijd", "looptijd"),
    ),
    "date": ("date", "datum", "day", "tag", "jour", "data", "giorno", "fecha", "día"),
    "temperature": (
        *(
            "temp",
            "test temperature",
            "test temp",
            "specimen temp",
            "creep temperature",
            "specimen temperature",
            "sample temperature",
        ),
        *("furnace", "furnace temperature", "oven temperature", "temperatur", "prüftemperatur", "versuchstemperatur"),
        *("probentemperatur", "ofen", "ofentemperatur", "temperatur ofen", "température", "température d'essai"),
        *("four", "temp ctrl", "試験温度", "温度", "temp d'essai", "prüftemp", "versuchstemp", "probentemp", "nt11"),
        *("temperatura", "temperatura di prova", "temperatura provino", "temperatura de ensayo", "forno", "horno"),
        *("temperatuur", "proeftemperatuur", "oventemperatuur", "temperatuur oven", "oven"),
    ),
    "stress": (
        *("applied stress", "nominal stress", "initial stress", "creep stress", "test stress", "engineering stress"),
        *("remaining stress", "residual stress", "relaxed stress", "restspannung", "spannung", "prüfspannung"),
        *("nennspannung", "anfangsspannung", "contrainte", "contrainte initiale", "contrainte appliquée", "応力"),
        *("contrainte nominale", "tensile stress", "axial stress", "s mises", "mises stress", "von mises stress"),
        *("sforzo", "sforzo applicato", "sforzo nominale", "tensione", "tensione applicata", "tensione nominale"),
        *("tensione residua", "sollecitazione", "tensión", "tensión aplicada", "tensión nominal", "tensión inicial"),
        *("tensión residual", "esfuerzo", "esfuerzo aplicado", "spanning", "aangelegde spanning", "nominale spanning"),
        *("beginspanning", "proefspanning", "kruipspanning"),
    ),
    "pressure": ("druck", "prüfdruck", "innendruck", "pression", "pressione", "presión", "druk"),
    "strain": (
        *("hold strain", "held strain", "strain held", "total strain held", "imposed strain", "applied strain"),
        *("deformazione imposta", "deformación impuesta", "creep", "total creep", "total creep strain", "dehnung"),
        *("axial strain", "tensile strain", "クリープひずみ", "zeitdehnung", "déformation", "allongement relatif"),
        *("deformation relative", "tensile strain extensometer", "deformazione", "deformación", "rek", "kruip"),
        *("opgelegde rek", "eps cr", "eps c", "e cr", "ε cr", "ε c", "creep eps"),
    ),
    "diametral_strain": (
        *("diametrical strain", "diameter strain", "hoop strain", "circumferential strain", "umfangsdehnung"),
        *("tangentialdehnung", "déformation diamétrale", "déformation circonférentielle"),
    ),
    "diameter_growth": (
        *("diameter change", "change of diameter", "diameter increase", "durchmesseränderung"),
        *("variazione di diametro", "variación de diámetro"),
    ),
    "loading_strain": ("anfangsdehnung",),
    "force": (
        *("load", "applied load", "axial load", "axial force", "tensile load", "tensile force", "load cell", "kraft"),
        *("prüfkraft", "standardkraft", "last", "zugkraft", "effort", "force axiale", "carico", "carico applicato"),
        *("forza", "carga", "carga aplicada", "fuerza", "kracht", "belasting", "trekkracht"),
    ),
    "elongation": (
        *(
            "extension",
            "extn",
            "ext",
            "creep extension",
            "extensometer",
            "extensometerweg",
            "gauge extension",
            "axial extension",
        ),
        *("tensile extension", "axial extensometer", "strain gauge extension", "extensometer extension"),
        *("längenänderung", "verlängerung", "allongement", "height change", "change in height", "shortening"),
        *("stauchung", "höhenänderung", "raccourcissement", "variation de hauteur", "allungamento", "alargamiento"),
        *("elongación", "estensione", "verlenging", "lengteverandering"),
    ),
    "modulus": (
        *("young's modulus", "youngs modulus", "elastic modulus", "modulus of elasticity", "e modulus", "e modul"),
        *("elastizitätsmodul", "module d'young", "module d'élasticité", "modulo di young", "modulo elastico"),
        *("módulo de young", "módulo elástico", "módulo de elasticidad", "elasticiteitsmodulus"),
    ),
    "thermal_expansion": ("coefficient of thermal expansion", "cte", "wärmeausdehnungskoeffizient"),
    "poisson": ("poisson's ratio", "poissons ratio", "poisson ratio"),
    "rupture": (
        *("rupture time", "time to rupture", "rupture life", "creep life", "t rupture", "ttr", "ttf", "bruchzeit"),
        *("standzeit", "temps à rupture", "durée de vie", "tempo a rottura", "tempo di rottura", "durata a rottura"),
        *("tiempo de rotura", "tiempo a rotura", "tiempo hasta rotura", "tiempo a la rotura", "破断時間", "breuktijd"),
        *("tijd tot breuk", "tijd tot bezwijken", "levensduur", "standtijd"),
    ),
    "end_time": (
        *("end time", "duration", "test duration", "time on test", "hours on test", "prüfdauer", "versuchsdauer"),
        *("durée d'essai", "temps d'essai", "durée de l'essai", "durata", "durata prova", "durata della prova"),
        *("duración", "duración del ensayo", "proefduur", "duur", "duur van de proef", "beproevingsduur"),
    ),
    "minimum_rate": (
        *("minimum rate", "minimum creep rate", "mcr", "minimale kriechrate", "velocità minima"),
        *("velocità minima di creep", "velocidad mínima", "velocidad mínima de fluencia", "最小クリープ速度"),
        *("minimale kruipsnelheid", "kleinste kruipsnelheid", "stationaire kruipsnelheid"),
    ),
    "minimum_rate_sd": ("minimum rate sd", "min rate sd", "minimum creep rate sd", "min creep rate sd"),
    "strain_sd": ("standard deviation of strain", "strain standard deviation"),
    "diameter": (
        *("specimen diameter", "sample diameter", "initial diameter", "gauge diameter", "durchmesser"),
        *("probendurchmesser", "anfangsdurchmesser", "diamètre", "diamètre initial", "mean diameter", "dia", "diam"),
        *("average diameter", "measured diameter", "mittlerer durchmesser", "diamètre moyen", "diametro"),
        *("diametro iniziale", "diametro provino", "diámetro", "diámetro inicial", "begindiameter"),
        *("diameter proefstaaf",),
    ),
    "gauge_length": (
        *("gage length", "initial gauge length", "original gauge length", "reference length", "messlänge"),
        *("anfangsmesslänge", "anfangsmesslänge le", "anfangsmesslänge l0", "messbasis", "longueur utile"),
        *("longueur de base", "longueur de référence", "longueur entre repères", "lunghezza utile", "tratto utile"),
        *("base di misura", "longitud útil", "longitud calibrada", "longitud de referencia", "meetlengte"),
        *("beginmeetlengte",),
    ),
    "height": (
        *("specimen height", "sample height", "initial height", "original height", "höhe", "probenhöhe", "hauteur"),
        *("anfangshöhe", "ausgangshöhe", "hauteur initiale", "hauteur éprouvette", "altezza", "altura"),
    ),
    "outer_diameter": (
        *("od", "o.d.", "outside diameter", "tube diameter", "mean od", "mean outer diameter", "aussendurchmesser"),
        *("außendurchmesser", "diamètre extérieur"),
    ),
    "deflection": (
        *("midspan deflection", "deflection at midspan", "centre deflection", "center deflection", "durchbiegung"),
        *("central deflection", "mid span deflection", "durchbiegung mitte", "mittendurchbiegung", "flèche"),
        *("flèche au centre", "load point deflection", "load point displacement", "deflection at load points"),
        *("apex height", "apex deflection", "dome height", "bulge height", "pole height", "kuppelhöhe", "wölbhöhe"),
        *("freccia", "flecha"),
    ),
    "notch_diameter": ("minimum diameter", "root diameter", "notch root diameter", "kerbdurchmesser"),
    "span": (
        *("outer span", "support span", "outer support span", "lower span", "outer roller spacing", "support distance"),
        *("distance between supports", "auflagerabstand", "stützweite", "äußere stützweite", "portée"),
        *("distance entre appuis",),
    ),
    "inner_span": (
        *("inner span", "load span", "loading span", "inner loading span", "inner support span", "upper span"),
        *("inner roller spacing", "innere stützweite", "laststützweite", "lastabstand", "portée intérieure"),
    ),
    "width": ("specimen width", "breite", "probenbreite", "largeur", "larghezza", "ancho", "anchura", "breedte"),
    "thickness": (
        *("specimen thickness", "wall thickness", "wall", "dicke", "blechdicke", "probendicke", "wandstärke"),
        *("wanddicke", "épaisseur", "épaisseur de paroi", "spessore", "espesor", "dikte", "wanddikte"),
    ),
    "area": (
        *("cross section", "cross-section", "cross-sectional area", "cross section area", "initial area"),
        *("querschnitt", "querschnittsfläche", "anfangsquerschnitt", "section", "section initiale", "sezione"),
        *("sezione iniziale", "area iniziale", "sección", "sección inicial", "área inicial", "doorsnede"),
        *("begindoorsnede", "dwarsdoorsnede"),
    ),
    "specimen": (
        *("specimen type", "specimen form", "specimen shape", "specimen geometry", "type of specimen", "probenform"),
        *("probentyp", "probengeometrie", "type d'éprouvette", "forme d'éprouvette", "tipo di provino"),
        *("tipo de probeta",),
    ),
    "alloy": (
        *("material", "werkstoff", "matériau", "alliage", "legierung", "composition", "nuance", "steel", "grade"),
        *("materiale", "lega", "acciaio", "aleación", "acero", "鋼種", "materiaal", "legering", "staal", "werkstof"),
    ),
    "name": ("test name", "test id", "test", "試験片番号"),
    "label heat": (
        *("heat", "cast", "batch", "charge", "schmelze", "heat number", "heat no", "heat id", "coulée"),
        *("reference code", "colata", "colada", "チャージ", "smelt", "gietcharge"),
    ),
    "label laboratory": ("laboratory", "lab", "labor", "laboratoire", "laboratorio"),
    "label operator": ("prüfer", "tester", "operatore", "operador"),
    "label elongation_pct": (
        *(
            "rupture elongation",
            "elongation at rupture",
            "elongation after fracture",
            "bruchdehnung",
            "bruchdehnung a",
            "zeitbruchdehnung",
        ),
        *("allongement à rupture", "allungamento a rottura", "alargamiento a rotura", "伸び", "rek bij breuk"),
        *("breukrek",),
    ),
    "label reduction_of_area_pct": (
        *("reduction of area", "area reduction", "reduction in area", "brucheinschnürung", "einschnürung", "striction"),
        *("striction à rupture", "strizione", "strizione a rottura", "estricción", "絞り", "insnoering"),
    ),
}
"""{quantity, key of a text or of a label: its names in small letters}; a forecast tells the scatter between heats and
laboratories apart."""


_TRUE = (
    *("true strain", "logarithmic strain", "true creep strain", "hencky strain", "wahre dehnung", "eps true"),
    *("log strain", "déformation vraie", "déformation rationnelle", "logarithmische dehnung"),
)
_NOMINAL = ("engineering strain", "nominal strain", "technische dehnung", "déformation nominale")
STATED_BY_NAME: Mapping[str, tuple[str, str]] = {
    **dict.fromkeys(_TRUE, ("strain_measure", "logarithmic")),
    **dict.fromkeys(_NOMINAL, ("strain_measure", "engineering")),
    **dict.fromkeys(("total strain", "gesamtdehnung", "déformation totale"), ("includes_elastic", "yes")),
    **dict.fromkeys(("deformazione totale", "deformación total", "totale rek"), ("includes_elastic", "yes")),
    **dict.fromkeys(("deformazione di creep", "deformazione viscosa", "kruiprek"), ("includes_elastic", "no")),
    **dict.fromkeys(("deformación de fluencia", "deformación por fluencia"), ("includes_elastic", "no")),
    **dict.fromkeys(("deformazione vera", "deformación verdadera"), ("strain_measure", "logarithmic")),
    **dict.fromkeys(("ε tot", "eps tot", "ε total", "dehnung gesamt"), ("includes_elastic", "yes")),
    **dict.fromkeys(("creep strain", "kriechdehnung", "déformation de fluage"), ("includes_elastic", "no")),
    **dict.fromkeys(("plastische dehnung", "bleibende dehnung", "ceeq"), ("includes_elastic", "no")),
}
"""{name of a column of strains in small letters: key and text of the condition that it states}."""


NAME_SYNONYMS: Mapping[str, str] = {
    **{name: meaning for meaning, names in NAMES_OF.items() for name in names},
    **dict.fromkeys(STATED_BY_NAME, "strain"),
}
"""{name in small letters: quantity or text key}."""


SYMBOLS: Mapping[str, str] = {
    **{"t": "time", "T": "temperature", "σ": "stress", "sigma": "stress", "ε": "strain", "epsilon": "strain"},
    **{"P1": "pressure_1", "P2": "pressure_2", "Tj": "jump_time"},
    **{"p": "pressure", "P": "pressure", "E": "modulus", "ν": "poisson", "nu": "poisson"},
    **{"F": "force", "ΔL": "elongation", "Δl": "elongation", "ΔL0": "elongation", "dL": "elongation"},
    **dict.fromkeys(("σ0", "σo", "σ₀", "R0", "Ro", "sig"), "stress"),
    **dict.fromkeys(("eps", "ε_c", "εc", "ε_cr"), "strain"),
    **dict.fromkeys(("d0", "D0", "D", "ø", "Ø", "⌀"), "diameter"),
    **dict.fromkeys(("ΔD", "Δd", "dD"), "diameter_growth"),
    **dict.fromkeys(("L0", "l0", "Lo", "Le", "Lr0"), "gauge_length"),
    **dict.fromkeys(("S0", "A0", "So", "Ao"), "area"),
    **dict.fromkeys(("h0", "H0", "h₀", "H₀"), "height"),
}
"""{symbol: quantity}; capitals matter."""
