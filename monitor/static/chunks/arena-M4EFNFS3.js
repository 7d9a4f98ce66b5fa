import{a}from"./chunk-E5F5VIIP.js";import"./chunk-4NWOAGQG.js";import"./chunk-TVFVYDZP.js";import"./chunk-PYE62S2K.js";import"./chunk-OULW4S7M.js";import"./chunk-6DHFEWGX.js";export{a as Arena};
