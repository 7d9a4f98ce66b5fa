import{a}from"./chunk-DJJ4FKPB.js";import"./chunk-4NWOAGQG.js";import"./chunk-TVFVYDZP.js";import"./chunk-PYE62S2K.js";import"./chunk-OULW4S7M.js";export{a as Arena};
