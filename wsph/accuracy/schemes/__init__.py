"""Which scheme suits a scene, by measurement (`advice`, rules.json), and what another says of an answer (`second`)."""
