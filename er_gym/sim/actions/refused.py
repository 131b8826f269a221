"""AI2-THOR's actions that the embedded engine lacks, each with the reason in one sentence."""

from __future__ import annotations

_BY_REASON = {
    "houses come from CreateHouse alone, and the engine finds their floors itself": (
        "GetHouseFromTemplate DestroyHouse BakeNavMesh ReBakeNavMeshes "
        "OverwriteNavMeshes GetNavMeshConfigs CreateNewNavMesh SetSkybox CreateSkybox"
    ),
    "it has no database of assets to make objects from; backend='unity' has": (
        "CreateObject CreateObjectAtLocation CreateObjectOnFloor CreateObjectPrefab "
        "RandomlyCreateAndPlaceObjectOnFloor RandomlyCreateLiftedFurniture SpawnAsset "
        "SpawnObjectInReceptacle SpawnObjectInReceptacleRandomly SpawnObjectInScene "
        "SpawnTargetCircle SpamObjectsInRoom CoverSurfacesWith ColorSurfaceColorObjectsByDistance "
        "GetAssetDatabase AssetInDatabase AssetsInDatabase TouchProceduralLRUCache "
        "DeleteLRUFromProceduralCache GetLRUCacheKeys GetAssetHoleMetadata GetAssetSphereBounds "
        "GetAsset3DGeometry SimObjPhysicsTypeIsReceptacle LookAtObjectCenter RotateObject "
        "RemoveObject"
    ),
    "objects have boxes and no meshes here; axisAlignedBoundingBox and "
    "objectOrientedBoundingBox tell their sizes": (
        "GetInSceneAssetGeometry GetApproximateVolume GetVolumeOfAllObjects ScaleObject "
        "CollidersObjectCollidingWith GetReachablePositionsForObject "
        "GetUnreachableSilhouetteForObject"
    ),
    "its pictures have no masks painted over objects; renderInstanceSegmentation tells where each "
    "is": (
        "MaskObject UnmaskObject EmphasizeObject UnemphasizeAll MaskMovingParts UnmaskMovingParts "
        "MaskWalkable UnmaskWalkable SegmentVisibleObjects GetApproxObjectMask "
        "SetAllObjectsToBlueUnlit SetAllObjectsToBlueStandard HideBlueObjects "
        "ToggleColorIntoTypeReceptacleFloors ApproxPercentScreenObjectFromPositions"
    ),
    "its pictures have neither fog nor cracks nor transparency to set, and one set of lights": (
        "EnableFog DisableFog CameraCrack MakeObjectTransparent MakeObjectOpaque "
        "HideTranslucentObjects HideTransparentStructureObjects UnhideStructureObjects "
        "HideObscuringObjects ChangeLightSet GetLights SetLights VisualizeWaypoints"
    ),
    "its answer is in a field of old metadata; use GetInteractablePoses, GetVisibleObjects and "
    "pictures with depth": (
        "GetPositionsObjectVisibleFrom ObjectsInBox FlatSurfacesOnGrid GetMetadataOnGrid"
    ),
    "it is for hide and seek, whose objects the recorded rooms lack": (
        "ToggleHideAndSeekObjects RandomizeHideSeekObjects StackBooks ExhaustiveSearchForItem "
        "OpenObjectAtLocation CloseObjectAtLocation OpenWithHand GetAwayFromObject "
        "DisableObjectCollisionWithAgent RotateUniverseAroundAgent"
    ),
    "it is for the table rooms FloorPlan501 to 505, which are not among the recorded ones": (
        "InitializeTableSetting PlaceFixedReceptacleAtLocation PlaceBookWallAtLocation "
        "PointsOverTableWhereHandCanBe"
    ),
    "it is for agents that carry furniture together, and no furniture is lifted here": (
        "MoveLiftedObjectAhead MoveLiftedObjectBack MoveLiftedObjectLeft MoveLiftedObjectRight "
        "RotateLiftedObjectRight MoveAgentsAheadWithObject MoveAgentsBackWithObject "
        "MoveAgentsLeftWithObject MoveAgentsRightWithObject"
    ),
    "objects and the agent have one size and nothing is nailed down or tied together here": (
        "SetAgentRadius SetAgentCapsuleRadius MakeAllObjectsStationary ParentObject UnparentObject"
    ),
    "it has the default agent and neither arm, LoCoBot, drone nor Stretch; backend='unity' has": (
        "MoveArm MoveArmRelative MoveArmBase MoveArmBaseUp MoveArmBaseDown MoveMidLevelArm "
        "RotateWristRelative RotateWrist RotateElbow RotateElbowRelative ReleaseObject "
        "SetHandSphereRadius GetHandSphereRadius MoveAgent RotateAgent ToggleGripper "
        "SetGripperOpenness RotateCameraBase FlyAhead FlyBack FlyLeft FlyRight FlyUp FlyDown FlyTo "
        "FlyAssist FlyRandomStart LaunchDroneObject SpawnDroneLauncher"
    ),
}
REFUSED = {name: reason for reason, names in _BY_REASON.items() for name in names.split()}
"""Actions of AI2-THOR that the embedded engine lacks, with the reason."""
